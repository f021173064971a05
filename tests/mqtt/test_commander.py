"""From message to answer, without a broker."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from gateway.bridge.api import BridgeError
from gateway.northbound.mqtt.commander import Commander
from gateway.northbound.mqtt.message import Incoming, Lane
from gateway.northbound.mqtt.once import WAITING_LIMIT
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.runner import LIMIT, STOP_LIMIT, Runner
from gateway.northbound.mqtt.topics import Topics
from gateway.tag import Instant, Role
from tests.fakes import FakeBridge

WALL = 1_800_000_000_000_000_000
EPOCH = "e" * 16


class Bench:
    """A commander on a fake bridge, and what it answered."""

    def __init__(self) -> None:
        self.bridge = FakeBridge()
        self.outbox = Outbox()
        self.now = Instant(100.0, WALL)
        self.runner = Runner(self.bridge, Role.OPERATOR, "mqtt://b:1883")
        catalogue = self.bridge.catalogue
        topics = Topics("plant7", "gw1", catalogue.drives, catalogue.lines)
        self.commander = Commander(topics, catalogue.owners, self.runner, self.outbox, lambda: self.now)

    def send(
        self,
        name: str,
        document: Any = None,
        *,
        retain: bool = False,
        to: str = "plant7/fan-1",
        **extras: Any,
    ) -> None:
        payload = b"" if document is None else json.dumps(document).encode()
        topic = f"{to}/cmd/{name}"
        self.commander.receive(
            Incoming(topic=topic, payload=payload, retain=retain, epoch=EPOCH, arrived=self.now, **extras)
        )

    def set_frequency(self, id: object, value: float = 30.0, **extras: Any) -> None:
        self.send("frequency_command", {"id": id, "v": value, "epoch": EPOCH}, **extras)

    async def answers(self) -> list[tuple[str, Any]]:
        """What was sent so far, after everything under way is done."""
        await self.runner.finish(5.0)
        self.outbox.connected(("birth", b"{}"))
        messages = [m for m in iter(self.outbox.take, None) if m.lane is Lane.ANSWER]
        return [(m.topic, json.loads(m.payload)) for m in messages]


@pytest.fixture
async def bench() -> Bench:
    return Bench()


async def test_one_answer_per_command(bench: Bench) -> None:
    bench.set_frequency("a")
    ((topic, answer),) = await bench.answers()
    assert topic == "plant7/fan-1/ack/frequency_command"
    assert (answer["id"], answer["verdict"]) == ("a", "confirmed")


async def test_the_same_id_for_something_else_is_refused_and_not_written(bench: Bench) -> None:
    bench.set_frequency("a", 30.0)
    bench.set_frequency("a", 40.0)
    answers = [answer for _, answer in await bench.answers()]
    assert {answer.get("cause") for answer in answers} == {None, "duplicate"}
    assert [write[1] for write in bench.bridge.writes] == [30.0]


async def test_h3_nothing_is_said_of_a_command_under_way_however_often_it_is_repeated(bench: Bench) -> None:
    bench.bridge.delay = 0.05
    for _ in range(1 + 2 * WAITING_LIMIT):
        bench.set_frequency("a")
    answers = [answer for _, answer in await bench.answers()]
    assert [answer["verdict"] for answer in answers] == ["confirmed"] * (1 + WAITING_LIMIT)
    assert len(bench.bridge.writes) == 1


async def test_the_same_id_from_another_sender_or_for_another_point_is_another_command(bench: Bench) -> None:
    bench.send("frequency_command", {"id": 1, "v": 5, "epoch": EPOCH, "by": "ann"})
    bench.send("frequency_command", {"id": 1, "v": 5, "epoch": EPOCH, "by": "bob"})
    bench.send("input_5", {"id": 1, "v": True, "epoch": EPOCH, "by": "ann"})
    await bench.answers()
    assert len({write[4] for write in bench.bridge.writes}) == 3


async def test_too_many_commands_are_refused_but_stop_passes(bench: Bench) -> None:
    bench.bridge.delay = 0.05
    for number in range(LIMIT + 10):
        bench.set_frequency(number)
    bench.send("stop")
    answers = await bench.answers()
    assert sum(answer.get("cause") == "overflow" for _, answer in answers) == 10
    assert len(bench.bridge.writes) == LIMIT
    assert ("stop", "confirmed") in [(topic.rsplit("/")[-1], a["verdict"]) for topic, a in answers]


LINE = "plant7/_gateway/gw1/lines/north"


async def test_a_stop_to_all_passes_too_without_id_or_payload(bench: Bench) -> None:
    bench.bridge.delay = 0.05
    for number in range(LIMIT):
        bench.set_frequency(str(number))
    bench.send("stop_all", to=LINE)
    answers = await bench.answers()
    assert (f"{LINE}/ack/stop_all", "confirmed") in [(topic, a["verdict"]) for topic, a in answers]
    assert [(owner, name) for owner, name, *_ in bench.bridge.commands] == [("_north", "stop_all")]


async def test_other_commands_to_all_are_as_fresh_as_any(bench: Bench) -> None:
    bench.send("run_forward_all", to=LINE)
    bench.send("run_forward_all", {"id": "a", "epoch": EPOCH}, to=LINE)
    bench.send("utilisation", {"id": "b", "epoch": EPOCH, "v": 1}, to=LINE)
    bench.send("lease", {"id": "c", "epoch": EPOCH, "v": "acquire"}, to=LINE)
    answers = [(answer["id"], answer["verdict"]) for _, answer in await bench.answers()]
    assert sorted(answers, key=str) == [
        ("a", "confirmed"),
        ("b", "refused"),
        ("c", "refused"),
        (None, "refused"),
    ]
    assert [(owner, name) for owner, name, *_ in bench.bridge.commands] == [("_north", "run_forward_all")]


async def test_of_a_flood_of_stops_the_newest_is_carried_out_and_all_are_answered(bench: Bench) -> None:
    bench.bridge.delay = 0.02
    for number in range(100):
        bench.send("stop", {"id": number})
    answers = [answer for _, answer in await bench.answers()]
    done = [answer["id"] for answer in answers if answer["verdict"] == "confirmed"]
    assert sorted(done) == [*range(STOP_LIMIT), 99]
    assert len(bench.bridge.commands) == STOP_LIMIT + 1
    assert len(answers) == 100
    assert {answer["verdict"] for answer in answers} == {"confirmed", "superseded"}


async def test_clearing_a_retained_command_is_no_command(bench: Bench) -> None:
    bench.send("stop", retain=True)
    assert await bench.answers() == []
    assert bench.bridge.commands == []


async def test_answers_also_go_where_mqtt_5_asks_for_them(bench: Bench) -> None:
    bench.set_frequency("a", response_topic="me/answers", correlation=b"c")
    bench.set_frequency("b", response_topic="plant7/fan-1/cmd/stop", correlation=b"c")
    answers = await bench.answers()
    assert [topic for topic, a in answers if a["id"] == "a"] == [
        "plant7/fan-1/ack/frequency_command",
        "me/answers",
    ]
    assert [topic for topic, a in answers if a["id"] == "b"] == ["plant7/fan-1/ack/frequency_command"]


async def test_when_the_core_goes_away_the_outcome_is_unknown(bench: Bench) -> None:
    async def gone(*_: object) -> Any:
        raise BridgeError("closed")

    bench.bridge.write = gone  # type: ignore[method-assign]
    bench.set_frequency("a")
    ((_, answer),) = await bench.answers()
    assert (answer["verdict"], answer["cause"]) == ("unknown", "no_answer")


async def test_at_the_end_what_is_unfinished_is_unknown_and_what_is_new_refused(bench: Bench) -> None:
    bench.bridge.delay = 60.0
    bench.set_frequency("a")
    await asyncio.sleep(0)
    bench.commander.closing = True
    bench.set_frequency("b")
    await bench.runner.finish(0.01)
    answers = {answer["id"]: answer for _, answer in await bench.answers()}
    assert (answers["a"]["verdict"], answers["a"]["cause"]) == ("unknown", "shutting_down")
    assert (answers["b"]["verdict"], answers["b"]["cause"]) == ("refused", "shutting_down")


async def test_what_is_at_no_topic_is_refused_where_it_was_asked(bench: Bench) -> None:
    bench.send("no_such_point", {"id": 1, "v": 1, "epoch": EPOCH})
    ((topic, answer),) = await bench.answers()
    assert topic == "plant7/fan-1/ack/no_such_point"
    assert (answer["id"], answer["cause"]) == (1, "unknown_tag")
    assert bench.bridge.writes == []


async def test_an_unwritable_point_is_for_the_core_to_refuse(bench: Bench) -> None:
    bench.send("running", {"id": 1, "v": True, "epoch": EPOCH})
    await bench.answers()
    assert bench.bridge.writes[0][0] == "fan-1.running"


@pytest.mark.parametrize(
    ("document", "more", "cause"),
    [
        ({"id": 1, "v": 30.0, "epoch": EPOCH, "by": "ann"}, {"retain": True}, "retained"),
        ({"id": 1, "v": 30.0, "epoch": "f" * 16, "by": "ann"}, {}, "wrong_epoch"),
        ({"id": 1, "v": 30.0, "by": "ann", "exp": "2001-01-01T00:00:00Z"}, {}, "expired"),
        ({"id": 1, "value": 30.0, "by": "ann"}, {}, "malformed"),
    ],
)
async def test_r1_what_a_rule_here_does_not_let_pass_is_on_record_too(
    bench: Bench, document: dict[str, object], more: dict[str, Any], cause: str
) -> None:
    bench.send("frequency_command", document, **more)
    *_, (_, answer) = await bench.answers()
    assert answer["cause"] == cause
    [(what, wanted, origin, outcome)] = bench.bridge.turned
    assert (what, outcome.cause) == ("fan-1.frequency_command", cause)
    assert "30.0" in wanted
    assert (origin.through, origin.authenticated) == ("mqtt", False)
    assert bench.bridge.writes == []


async def test_leases_and_maintenance_are_asked_of_the_gateway_itself(bench: Bench) -> None:
    bench.send("lease", {"id": 1, "v": "take", "epoch": EPOCH, "by": "anna", "from": "bob"})
    bench.send("maintenance", {"id": 2, "v": True, "epoch": EPOCH, "by": "anna", "reason": "bearing"})
    answers = await bench.answers()
    assert [topic for topic, _ in answers] == ["plant7/fan-1/ack/lease", "plant7/fan-1/ack/maintenance"]
    [(drive, act, origin, whom)] = bench.bridge.leases
    assert (drive, act, whom) == ("fan-1", "take", "bob")
    assert (origin.who, origin.address, origin.authenticated) == ("anna", "mqtt://b:1883", False)
    assert bench.bridge.maintained[0][1::2] == (True, "bearing")
    assert bench.bridge.writes == [] and bench.bridge.commands == []


async def test_h1_a_retained_lease_is_refused(bench: Bench) -> None:
    bench.send("lease", {"id": 1, "v": "acquire", "epoch": EPOCH}, retain=True)
    answers = await bench.answers()
    assert answers[-1][1]["cause"] == "retained"
    assert bench.bridge.leases == []


async def test_what_a_value_does_is_confirmed_in_the_payload(bench: Bench) -> None:
    bench.send("run_source", {"id": 1, "v": 1, "epoch": EPOCH, "confirm": "the panel is obeyed"})
    await bench.answers()
    assert bench.bridge.confirmed == ["the panel is obeyed"]


async def test_s2_a_command_is_known_to_come_from_nobody_in_particular(bench: Bench) -> None:
    bench.send("frequency_command", {"id": 1, "v": 30.0, "epoch": EPOCH, "by": "anna"})
    bench.send("frequency_command", {"id": 2, "v": 30.0, "epoch": "old", "by": "anna"})
    await bench.answers()
    origins = [bench.bridge.writes[0][2], bench.bridge.turned[0][2]]
    assert [(origin.who, origin.authenticated) for origin in origins] == [("anna", False)] * 2
