"""The embedded broker: a child on loopback for sites that have none of their own, and for the demo."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gateway.mapping.site import Site
from gateway.supervise.child import Child
from gateway.supervise.keeper import Keeper

HOST = "127.0.0.1"
USUAL_PORT = 1883


class Broker(Keeper):
    """Keeps the embedded broker running, always at the same address."""

    def __init__(self, folder: Path, port: int, log: int | None = None) -> None:
        """``folder`` holds its configuration and what it stores; it listens on loopback at ``port``."""
        super().__init__("broker")
        self._folder = folder
        self.port = port
        self._log = log

    @classmethod
    def for_site(cls, site: Site, log: int | None = None) -> Broker | None:
        """The broker that a site asks for with ``broker: embedded``; on the usual port if it is free."""
        if not any(cls.serves(section) for section in site.mqtt):
            return None
        return cls(site.data / "broker", free_port(USUAL_PORT), log)

    @staticmethod
    def serves(section: Mapping[str, Any]) -> bool:
        """True when an ``mqtt:`` section asks for the embedded broker."""
        return section.get("broker") == "embedded"

    @property
    def address(self) -> str:
        """Where clients find it: ``mqtt://127.0.0.1:1883``."""
        return f"mqtt://{HOST}:{self.port}"

    async def start(self) -> Child:
        from gateway.broker import binary, config_text

        self._folder.mkdir(parents=True, exist_ok=True)
        config = self._folder / "server.conf"
        config.write_text(config_text(self._folder / "store", self.port))
        return Child([str(binary()), "-c", str(config)], log=self._log)


def free_port(wanted: int) -> int:
    """``wanted`` if nothing listens there on loopback, else a port that is free at this moment."""
    for port in (wanted, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((HOST, port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise OSError("no port is free on loopback")
