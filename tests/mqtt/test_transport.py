"""Ways to a broker: passwords, TLS, websockets, brokers that do not answer or do not know MQTT 5."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import subprocess
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from gateway.broker import binary, config_text
from gateway.northbound.mqtt.connection import Connection, RefusedError
from gateway.northbound.mqtt.settings import settings_of
from tests.fakes import FakeBridge
from tests.mqtt.brokers import free_port
from tests.mqtt.conftest import adapter, section

WILL = ("plant7/_gateway/gw1/status", b"{}")


@contextmanager
def nats(folder: Path, config: str, port: int) -> Iterator[None]:
    """nats-server with a configuration of its own, until the port answers."""
    file = folder / "nats.conf"
    file.write_text(config)
    with (folder / "nats.log").open("wb") as log:
        process = subprocess.Popen([binary(), "--config", file], stdout=log, stderr=log)
    try:
        deadline = time.monotonic() + 10
        while b"Server is ready" not in (folder / "nats.log").read_bytes():
            assert time.monotonic() < deadline, (folder / "nats.log").read_text()
            time.sleep(0.02)
        yield
    finally:
        process.kill()
        process.wait()


@asynccontextmanager
async def connection(**changes: object) -> AsyncIterator[Connection]:
    broker = settings_of(section(1, **changes)).broker
    opened = Connection(broker, 4, "e" * 16, WILL)
    try:
        await opened.open()
        yield opened
    finally:
        opened.close()


def certificate(folder: Path) -> tuple[Path, Path]:
    """A self-signed certificate for 127.0.0.1 and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "broker")])
    now = datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))
        .not_valid_after(now + timedelta(hours=1))
        .add_extension(x509.SubjectAlternativeName([x509.IPAddress(ip_address("127.0.0.1"))]), critical=False)
        .sign(key, hashes.SHA256())
    )
    certificate_file, key_file = folder / "cert.pem", folder / "key.pem"
    certificate_file.write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    key_file.write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
    )
    return certificate_file, key_file


async def close(writer: asyncio.StreamWriter) -> None:
    writer.close()
    with contextlib.suppress(OSError):
        await writer.wait_closed()


async def test_user_and_password(tmp_path: Path) -> None:
    port = free_port()
    password = tmp_path / "password"
    password.touch(mode=0o600)
    url = f"mqtt://127.0.0.1:{port}"
    with nats(tmp_path, config_text(port, tmp_path / "store", user="gw", password='p"s'), port):
        password.write_text('p"s\n')
        async with connection(broker=url, user="gw", password_file=str(password)) as opened:
            assert await opened.subscribe(["plant7/fan-1/cmd/#"]) == []
        password.write_text("wrong")
        with pytest.raises(RefusedError):
            async with connection(broker=url, user="gw", password_file=str(password)):
                pass
        with pytest.raises(RefusedError):
            async with connection(broker=url):
                pass


async def test_small_messages_do_not_wait_for_each_other(tmp_path: Path) -> None:
    port = free_port()
    with nats(tmp_path, config_text(port, tmp_path / "store"), port):
        async with connection(broker=f"mqtt://127.0.0.1:{port}") as opened:
            sock: Any = opened._client.socket()
            assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) != 0


async def test_tls_checks_the_certificate(tmp_path: Path) -> None:
    port = free_port()
    certificate_file, key_file = certificate(tmp_path)
    tls = f'tls {{ cert_file: "{certificate_file}", key_file: "{key_file}" }}'
    plain = config_text(port, tmp_path / "store")
    config = plain.replace(f'"127.0.0.1:{port}" }}', f'"127.0.0.1:{port}", {tls} }}')
    assert config != plain
    url = f"mqtts://127.0.0.1:{port}"
    with nats(tmp_path, config, port):
        async with connection(broker=url, ca_file=str(certificate_file)) as opened:
            assert await opened.subscribe(["plant7/fan-1/cmd/#"]) == []
        with pytest.raises(OSError, match=r"(?i)certificate"):
            async with connection(broker=url):
                pass


async def test_websocket(tmp_path: Path) -> None:
    port, web = free_port(), free_port()
    config = (
        config_text(port, tmp_path / "store") + f'websocket {{ listen: "127.0.0.1:{web}", no_tls: true }}\n'
    )
    with nats(tmp_path, config, web):
        async with connection(broker=f"ws://127.0.0.1:{web}/mqtt") as opened:
            assert await opened.subscribe(["plant7/fan-1/cmd/#"]) == []


async def test_a_broker_that_never_answers_does_not_hold_up_the_end() -> None:
    arrived, left = asyncio.Event(), asyncio.Event()

    async def listen(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read(1)
        arrived.set()
        await reader.read()
        await close(writer)
        left.set()

    silent = await asyncio.start_server(listen, "127.0.0.1", 0)
    port = silent.sockets[0].getsockname()[1]
    async with silent:
        async with adapter(FakeBridge(section=section(port))):
            async with asyncio.timeout(5):
                await arrived.wait()
            begun = time.monotonic()
        assert time.monotonic() - begun < 2.0
        async with asyncio.timeout(10):
            await left.wait()


async def test_without_a_word_the_other_version_is_tried() -> None:
    levels: list[int] = []
    three = asyncio.Event()

    async def hang_up(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        connect = await reader.readexactly(9)
        levels.append(connect[connect.index(b"MQTT") + 4])
        await close(writer)
        if len(levels) >= 3:
            three.set()

    server = await asyncio.start_server(hang_up, "127.0.0.1", 0)
    async with server:
        port = server.sockets[0].getsockname()[1]
        async with adapter(FakeBridge(section=section(port))), asyncio.timeout(10):
            await three.wait()
    assert levels[:3] == [5, 4, 5]


async def test_garbage_from_the_broker_ends_the_connection_and_nothing_else() -> None:
    connections = 0
    again = asyncio.Event()

    async def babble(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal connections
        await reader.read(4)
        connections += 1
        writer.write(bytes([0x20, 0x03, 0x00, 0x00, 0x00]) + b"\x30\x05\x00\xff\xff\xff\xff" + b"\xff" * 300)
        await writer.drain()
        await close(writer)
        if connections >= 3:
            again.set()

    server = await asyncio.start_server(babble, "127.0.0.1", 0)
    async with server:
        port = server.sockets[0].getsockname()[1]
        async with adapter(FakeBridge(section=section(port))), asyncio.timeout(10):
            await again.wait()
