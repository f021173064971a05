"""Alarms: raised once, standing until their cause is gone and somebody has seen them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.bridge.messages import Acknowledge, AskHealth, Done, HealthIs
from gateway.core.alarms import Alarms
from gateway.core.events import Asked
from gateway.tag import Cause, Event, Instant, Origin, Outcome, Role, Verdict
from tests.core.world import OPERATOR, World

VIEWER = Origin(through="test", who="vera", role=Role.VIEWER)


class Site:
    """Alarms with what they told and what they recorded."""

    def __init__(self) -> None:
        self.told: list[Event] = []
        self.journal: list[dict[str, Any]] = []
        self.alarms = Alarms(self.told.append, self._record)
        self.now = Instant(0.0, 1)

    def tick(self) -> Instant:
        self.now = Instant(self.now.mono + 1.0, self.now.wall + 1_000_000_000)
        return self.now

    def acknowledge(self, key: str, origin: Origin = OPERATOR, ceiling: Role = Role.ADMIN) -> Outcome:
        return self.alarms.acknowledge(key, origin, ceiling, self.tick())

    def names(self) -> list[str]:
        return [event.name.removeprefix("alarm_") for event in self.told]

    def _record(self, entry: dict[str, Any]) -> int:
        self.journal.append(entry)
        return len(self.journal)


def test_an_alarm_stands_until_it_is_seen_and_over() -> None:
    site = Site()
    site.alarms.raise_("fan-1", "comm_loss", "it would run on", site.tick())
    site.alarms.raise_("fan-1", "comm_loss", "it would still run on", site.tick())
    [alarm] = site.alarms.standing()
    assert (alarm.key, alarm.text) == ("fan-1.comm_loss", "it would still run on")
    assert site.acknowledge("fan-1.comm_loss").verdict is Verdict.CONFIRMED
    [alarm] = site.alarms.standing()
    assert alarm.by == "otto"
    site.alarms.clear("fan-1", "comm_loss", site.tick())
    assert site.alarms.standing() == ()
    assert site.names() == ["raised", "acknowledged", "cleared"]
    assert [entry["did"] for entry in site.journal] == site.names()


def test_a_cause_that_goes_leaves_the_alarm_until_it_is_seen() -> None:
    site = Site()
    site.alarms.set("gateway", "journal", "disk full", site.tick())
    site.alarms.set("gateway", "journal", "", site.tick())
    site.alarms.set("gateway", "journal", "", site.tick())
    assert len(site.alarms.standing()) == 1
    site.acknowledge("gateway.journal")
    assert site.alarms.standing() == ()
    assert site.names() == ["raised", "cleared", "acknowledged"]


def test_what_happens_once_stands_until_it_is_seen() -> None:
    site = Site()
    site.alarms.raise_("fan-1", "restarted", "fan-1 restarted", site.tick(), once=True)
    site.alarms.raise_("fan-1", "restarted", "fan-1 restarted again", site.tick(), once=True)
    assert site.names() == ["raised"]
    site.acknowledge("fan-1.restarted")
    assert site.alarms.standing() == ()
    site.alarms.raise_("fan-1", "restarted", "fan-1 restarted", site.tick(), once=True)
    assert site.names() == ["raised", "acknowledged", "raised"]


@pytest.mark.parametrize(
    ("origin", "ceiling", "key", "cause"),
    [
        (VIEWER, Role.ADMIN, "fan-1.restarted", Cause.NO_RIGHTS),
        (OPERATOR, Role.VIEWER, "fan-1.restarted", Cause.NO_RIGHTS),
        (OPERATOR, Role.ADMIN, "fan-2.restarted", Cause.UNKNOWN_ALARM),
    ],
)
def test_e1_who_may_not_acknowledge_changes_nothing(
    origin: Origin, ceiling: Role, key: str, cause: Cause
) -> None:
    site = Site()
    site.alarms.raise_("fan-1", "restarted", "fan-1 restarted", site.tick(), once=True)
    outcome = site.acknowledge(key, origin, ceiling)
    assert (outcome.verdict, outcome.cause) == (Verdict.REFUSED, cause)
    assert [alarm.acknowledged for alarm in site.alarms.standing()] == [0]
    assert site.names() == ["raised"]


@given(st.lists(st.sampled_from(["raise", "clear", "acknowledge"])))
def test_whatever_happens_nothing_is_told_twice(doings: list[str]) -> None:
    """The model: an alarm has a cause or not, and is seen or not."""
    site = Site()
    cause, unseen, told = False, False, []
    do: dict[str, Callable[[], object]] = {
        "raise": lambda: site.alarms.raise_("a", "b", "c", site.tick()),
        "clear": lambda: site.alarms.clear("a", "b", site.tick()),
        "acknowledge": lambda: site.acknowledge("a.b"),
    }
    for doing in doings:
        if doing == "raise" and not cause:
            cause, unseen = True, True
            told.append("raised")
        elif doing == "clear" and cause:
            cause = False
            told.append("cleared")
        elif doing == "acknowledge" and unseen:
            unseen = False
            told.append("acknowledged")
        do[doing]()
        assert site.names() == told
        assert bool(site.alarms.standing()) == (cause or unseen)


def test_r2_a_journal_that_cannot_be_written_is_an_alarm_that_health_shows() -> None:
    world = World()
    world.run(0.5)
    world.journal_problem = "disk full"
    world.write("fan-1.frequency_command", 10.0)
    world.feed(Asked(world.session, AskHealth(1000)))
    [health] = [m.health for m in world.told[world.session] if isinstance(m, HealthIs)]
    [alarm] = health.alarms
    assert alarm.key == "_gateway.journal"
    assert "disk full" in alarm.text
    assert "alarm_raised" in world.events()
    world.journal_problem = ""
    world.feed(Asked(world.session, Acknowledge(1001, "_gateway.journal", OPERATOR)))
    [done] = [m.outcome for m in world.told[world.session] if isinstance(m, Done) and m.id == 1001]
    assert done.verdict is Verdict.CONFIRMED
    world.run(0.5)
    assert world.core.alarms.standing() == ()


def test_alarms_that_nobody_has_seen_survive_a_restart() -> None:
    world = World()
    world.run(0.5)
    now = world.instant()
    world.core.alarms.raise_("fan-1", "restarted", "fan-1 restarted", now, once=True)
    world.core.alarms.raise_("fan-1", "comm_loss", "it would run on", now)
    world.core.alarms.raise_("fan-1", "local", "the panel has it", now)
    world.core.alarms.acknowledge("fan-1.local", OPERATOR, Role.ADMIN, now)
    world.run(0.5)
    world.restart()
    world.run(0.5)
    standing = world.core.alarms.standing()
    assert {alarm.key for alarm in standing} == {"fan-1.restarted", "fan-1.comm_loss"}
    assert all(alarm.cleared for alarm in standing)
    world.core.alarms.raise_("fan-1", "comm_loss", "it would run on", world.instant())
    assert [a.cleared for a in world.core.alarms.standing() if a.name == "comm_loss"] == [0]
