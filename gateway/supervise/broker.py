"""The embedded broker: a child on loopback for sites that have none of their own, and for the demo."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from typing import Any

from gateway.broker import HOST, BrokerMissingError, EmbeddedBroker
from gateway.mapping.site import Site
from gateway.supervise.child import Child
from gateway.supervise.keeper import Keeper, StartRefusedError

USUAL_PORT = 1883


class Broker(Keeper):
    """Keeps the embedded broker running, always at the same address."""

    def __init__(self, broker: EmbeddedBroker, log: int | None = None) -> None:
        super().__init__("broker")
        self._broker = broker
        self._log = log

    @classmethod
    def for_site(cls, site: Site, log: int | None = None) -> Broker | None:
        """The broker that a site asks for with ``broker: embedded``; on the usual port if it is free."""
        if not any(cls.serves(section) for section in site.mqtt):
            return None
        return cls(EmbeddedBroker(port=free_port(USUAL_PORT), folder=site.data / "broker"), log)

    @staticmethod
    def serves(section: Mapping[str, Any]) -> bool:
        """True when an ``mqtt:`` section asks for the embedded broker."""
        return section.get("broker") == "embedded"

    @property
    def address(self) -> str:
        """Where clients find it: ``mqtt://127.0.0.1:1883``."""
        return self._broker.url

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return self._broker.port

    async def start(self) -> Child:
        try:
            return Child(self._broker.command(), log=self._log)
        except BrokerMissingError as error:
            raise StartRefusedError(str(error)) from error


def free_port(wanted: int) -> int:
    """``wanted`` if nothing listens there on loopback, else a port that is free at this moment.

    Raises:
        OSError: if there is none.
    """
    try:
        return _bindable(wanted)
    except OSError:
        return _bindable(0)


def _bindable(port: int) -> int:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((HOST, port))
        return int(probe.getsockname()[1])
