"""Who commands the drives, through which adapter."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gateway.bridge.messages import RunCommand, TurnedAway, WriteTag
from gateway.northbound.mqtt.commander import Commander
from gateway.northbound.mqtt.message import Incoming
from gateway.northbound.mqtt.order import Order
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.topics import Topics
from gateway.tag import Origin, Outcome, Role, tag_of

if TYPE_CHECKING:
    from tests.prove.clients import Clients

EPOCH = "e" * 16
BROKER = "mqtt://b:1883"


@dataclass
class Person:
    """Somebody who commands. Where his way in knows sessions he has one; a new one each time he comes."""

    name: str
    through: str
    role: Role
    visits: int = 1

    @property
    def origin(self) -> Origin:
        """Who he is to the core."""
        if self.through == "mqtt":
            return Origin(through="mqtt", who=self.name, role=self.role, address=BROKER, authenticated=False)
        return Origin(
            through=self.through, who=self.name, role=self.role, session=f"{self.name}-{self.visits}"
        )


def everybody() -> list[Person]:
    """Two through OPC UA, two through a broker."""
    return [
        Person("anna", "opcua", Role.OPERATOR),
        Person("bert", "opcua", Role.ENGINEER),
        Person("carl", "mqtt", Role.OPERATOR),
        Person("dora", "mqtt", Role.OPERATOR),
    ]


class Office:
    """The command side of the MQTT adapter, in one life of it: what the real commander lets through goes to
    the core."""

    def __init__(self, clients: Clients) -> None:
        self._clients = clients
        box = clients.box
        assert box.core is not None
        catalogue = box.core.catalogue
        topics = Topics(catalogue.site, catalogue.gateway, catalogue.drives, catalogue.lines)
        self._site = catalogue.site
        self.hostile = ""
        self._commander = Commander(
            topics,
            catalogue.owners,
            self,
            Outbox(),
            box.instant,  # type: ignore[arg-type]
        )

    def publish(self, drive: str, name: str, document: Any, hostile: str = "", **extras: Any) -> None:
        """Somebody publishes a command; ``hostile`` says why it may not reach a wire."""
        payload = document if isinstance(document, bytes) else json.dumps(document).encode()
        self.hostile = hostile
        facts = {"retain": False, "epoch": EPOCH, "arrived": self._clients.box.instant()} | extras
        self._commander.receive(Incoming(topic=f"{self._site}/{drive}/cmd/{name}", payload=payload, **facts))
        self.hostile = ""

    # -- what the commander needs of a runner

    @property
    def full(self) -> bool:
        """Too much is under way."""
        return False

    def start(self, order: Order, done: Callable[[Outcome], None]) -> None:
        """An order is fresh and readable."""
        origin = Origin(through="mqtt", who=order.by, role=Role.OPERATOR, address=BROKER, authenticated=False)
        clients = self._clients
        number = clients.next_id()
        if order.args is None:
            ask: WriteTag | RunCommand = WriteTag(
                number, tag_of(order.drive, order.name), order.value, origin, order.ttl, order.bridge_id
            )
        else:
            ask = RunCommand(number, order.drive, order.name, order.args, origin, order.ttl, order.bridge_id)
        clients.commit("mqtt", ask, self.hostile, done)

    stop = start

    def turn_away(self, what: str, wanted: object, by: str, outcome: Outcome) -> None:
        """An order was turned away."""
        clients = self._clients
        clients.box.count("turned away by the MQTT adapter")
        origin = Origin(through="mqtt", who=by, role=Role.OPERATOR, address=BROKER, authenticated=False)
        clients.ask("mqtt", TurnedAway(clients.next_id(), what, wanted, origin, outcome))


def hostile_message(rng: random.Random, key: str, wall: int) -> tuple[str, Any, dict[str, Any]]:
    """A command by MQTT that is stale, retained, forged or no command at all: why, payload, extras."""
    fresh = {"id": key, "v": 20.0, "epoch": EPOCH, "by": "mallory"}
    old = wall / 1e9 - rng.uniform(0.5, 5000.0)
    return rng.choice(
        (
            ("retained", fresh, {"retain": True}),
            ("an old epoch", fresh | {"epoch": "0" * 16}, {}),
            ("expired", {"id": key, "v": 20.0, "exp": old}, {}),
            ("expired in the broker", fresh, {"expiry": 0}),
            ("no proof", {"id": key, "v": 20.0}, {}),
            ("an end too far ahead", {"id": key, "v": 20.0, "exp": wall / 1e9 + 4000.0}, {}),
            ("no id", {"v": 20.0, "epoch": EPOCH}, {}),
            ("no JSON", b'{"id": "x", "v": 20.0', {}),
            ("deep", b"[" * 3000, {}),
            ("huge", fresh | {"by": "m" * 5000}, {}),
            ("a list", fresh | {"v": [20.0]}, {}),
            ("not a number", b'{"id": "x", "v": NaN, "epoch": "eeeeeeeeeeeeeeee"}', {}),
            ("out of range", fresh | {"v": rng.choice((-1.0, 50.01, 1e9))}, {}),
        )
    )
