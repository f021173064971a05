"""The core as a process of its own: what ``python -m gateway.core`` does. Shell."""

from __future__ import annotations

import argparse
import asyncio
import gc
import signal
import socket
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import structlog

from gateway.bridge.api import BridgeError
from gateway.bridge.place import socket_path
from gateway.core.lock import data_lock
from gateway.core.loop import ExactLoop, go_first, stay_awake
from gateway.core.server import Server
from gateway.core.shell import Shell
from gateway.log import configure
from gateway.mapping.load import load_site
from gateway.mapping.site import Site
from gateway.tag import Role

log = structlog.get_logger(__name__)

EXIT_CONFIGURATION = 1
EXIT_LOCKED = 3

HEADER_BYTES = 4096

COLLECT_SECONDS = 600.0


class Adapter(msgspec.Struct, frozen=True):
    """What the supervisor says of the socket it hands over: for which adapter it is, and the highest
    role that its users may have. ``broker`` replaces the one of the configuration."""

    adapter: str
    index: int = 0
    broker: str | None = None
    ceiling: Role = Role.ENGINEER


def main(argv: Sequence[str] | None = None) -> int:
    """Run the core until a signal ends it; the process's exit code."""
    args = _arguments().parse_args(argv)
    configure("core")
    site, findings = load_site(Path(args.site))
    if site is None:
        for finding in findings:
            print(finding, file=sys.stderr)  # noqa: T201 - before there is anybody to log for
        return EXIT_CONFIGURATION
    if not go_first():
        log.info(
            "no right to real-time priority: other programs can delay the lines (README.md, As a service)"
        )
    if not stay_awake():
        log.info("no right to keep the processors awake: frames can leave late (README.md, As a service)")
    control = None if args.control_fd is None else socket.socket(fileno=args.control_fd)
    ports = dict(pair.split("=", 1) for pair in args.line)
    try:
        with data_lock(site.data), asyncio.Runner(loop_factory=ExactLoop) as runner:
            runner.run(_serve(site, ports, control))
    except BridgeError as error:
        log.error("not started", reason=str(error))
        return EXIT_LOCKED
    return 0


async def _serve(site: Site, ports: Mapping[str, str], control: socket.socket | None) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop.set)
    shell = Shell(site, ports)
    server = Server(shell)
    path = socket_path(site.data)
    await server.listen(path)
    shell.start()
    loop.call_soon(_collect, loop)
    listening = None if control is None else asyncio.create_task(_listen(control, server, site, stop))
    log.info("this is not a safety device: emergency stop and safe torque off stay hard-wired")
    log.info("core started", site=site.site, gateway=site.gateway, digest=site.digest[:12])
    await stop.wait()
    if listening is not None:
        listening.cancel()
    await shell.stop()
    await server.close()
    path.unlink(missing_ok=True)
    log.info("core stopped")


def _collect(loop: asyncio.AbstractEventLoop) -> None:
    """Look for garbage now and then, and not whenever Python likes to: that stops all lines for milliseconds,
    and next to nothing that the core makes needs it. What was there at the start is not looked at again."""
    gc.collect()
    if gc.isenabled():
        gc.freeze()
        gc.disable()
    loop.call_later(COLLECT_SECONDS, _collect, loop)


async def _listen(control: socket.socket, server: Server, site: Site, stop: asyncio.Event) -> None:
    """Say that we are ready, then take the sockets that the supervisor hands over. Its end is ours."""
    control.setblocking(False)
    loop = asyncio.get_running_loop()
    await loop.sock_sendall(control, msgspec.json.encode({"ready": True}) + b"\n")
    readable = asyncio.Event()
    loop.add_reader(control, readable.set)
    while True:
        await readable.wait()
        readable.clear()
        try:
            data, fds, _, _ = socket.recv_fds(control, HEADER_BYTES, 1)
        except BlockingIOError:
            continue
        if not data:
            break
        header = msgspec.json.decode(data, type=Adapter)
        server.adopt(socket.socket(fileno=fds[0]), header.ceiling, section_for(site, header))
    loop.remove_reader(control)
    log.warning("the supervisor is gone")
    stop.set()


def section_for(site: Site, header: Adapter) -> Mapping[str, Any]:
    """The part of the configuration that an adapter gets."""
    if header.adapter == "opcua":
        return site.opcua or {}
    section = dict(site.mqtt[header.index])
    return section if header.broker is None else {**section, "broker": header.broker}


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gateway.core", description="The core process; `gateway run` starts it."
    )
    parser.add_argument("--site", required=True, help="the site file")
    parser.add_argument("--control-fd", type=int, help="socket on which the supervisor hands over adapters")
    parser.add_argument("--line", action="append", default=[], metavar="NAME=PORT", help="use another port")
    return parser
