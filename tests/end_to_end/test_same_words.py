"""One attempt, one outcome: the same words in every protocol and on record (R1, T1, T2, E1, H12, H20)."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from gateway.bridge.api import LeaseAct
from gateway.northbound.opcua.status import outcome_status
from gateway.simulator.happening import PanelSets, Trip
from gateway.tag import Cause, Origin, Outcome, Role, Verdict
from tests.end_to_end.inside import Asked, Inside, Told, inside

pytestmark = pytest.mark.xdist_group("end_to_end")

BERTA = Origin(through="test", who="berta", role=Role.ADMIN)
WAYS = ("opcua", "mqtt", "cli")

Before = Callable[[Inside], Awaitable[None]]


class Row(NamedTuple):
    """An attempt, what it is to be answered, and what is done before it, each time."""

    id: str
    asked: Asked
    told: Told
    before: Before | None = None
    status: str = ""
    """The StatusCode, where OPC UA has a better one than its table of causes."""
    ways: tuple[str, ...] = WAYS


def refused(cause: str, reason: str) -> Told:
    return Told("refused", cause, reason)


def written(asked: Asked) -> Before:
    """Something is so already."""

    async def do(plant: Inside) -> None:
        drive, name = asked.drive, asked.name
        if asked.args is None:
            outcome = await plant.bridge.write(asked.what, asked.value, BERTA)
        else:
            outcome = await plant.bridge.command(drive, name, asked.args, BERTA)
        assert outcome.verdict is Verdict.CONFIRMED, outcome

    return do


async def leased(plant: Inside) -> None:
    assert (await plant.bridge.lease("fan-2", LeaseAct.ACQUIRE, BERTA)).verdict is Verdict.CONFIRMED


async def in_maintenance(plant: Inside) -> None:
    await plant.bridge.maintain("fan-2", True, BERTA, "bearing")


async def local(plant: Inside) -> None:
    plant.line.drives["fan-3"].post(PanelSets("run_source", 1))
    await seen(plant, "fan-3.run_source", 1)


async def undervoltage(plant: Inside) -> None:
    plant.line.drives["fan-3"].post(Trip("fault_low_voltage"))
    await seen(plant, "fan-3.fault_low_voltage", True)


async def unplugged(plant: Inside) -> None:
    plant.line.drives["fan-3"].connected = False
    limit = time.monotonic() + 20
    while (await plant.bridge.health()).drives["fan-3"] is not False:
        assert time.monotonic() < limit
        await asyncio.sleep(0.05)


async def seen(plant: Inside, tag: str, value: object) -> None:
    """Wait until the drive shows a value."""
    limit = time.monotonic() + 10
    while (await plant.bridge.read([tag]))[0].value != value:
        assert time.monotonic() < limit, tag
        await asyncio.sleep(0.02)


SETPOINT = Asked("fan-1", "frequency_command", 12.5)
RUN = Asked("fan-1", "run_forward", args={"frequency": 20.0})
STOP = Asked("fan-1", "stop", args={})
HARM = "initialises the whole drive"
LOCKED = (
    "read-only; or Sn or Cn while running; or undervoltage; or CPF04, but for Sn-02 and Sn-03; or busy with "
    "data; or Cn-02 to Cn-08 while Sn-02 is neither F nor FF"
)

ADMIN_ROWS = [
    Row("ok", SETPOINT, Told("confirmed", "", ""), written(Asked("fan-1", "frequency_command", 10.0))),
    Row("run", RUN, Told("confirmed", "", ""), written(STOP)),
    Row("stop", STOP, Told("confirmed", "", ""), written(RUN)),
    Row(
        "so already",
        Asked("fan-1", "motor_rated_current", 70),
        Told("confirmed", "", "it was so already"),
        written(Asked("fan-1", "motor_rated_current", 70)),
    ),
    Row(
        "out of range",
        Asked("fan-1", "frequency_command", 70.0),
        refused("out_of_range", "frequency_command = 70 is outside 0..60 Hz"),
    ),
    Row(
        "argument out of range",
        Asked("fan-1", "run_forward", args={"frequency": -0.5}),
        refused("out_of_range", "frequency = -0.5 is outside 0..60 Hz"),
    ),
    Row(
        "wrong type",
        Asked("fan-1", "frequency_command", "fast"),
        refused("wrong_type", "frequency_command takes a number, not 'fast'"),
    ),
    Row(
        "argument of wrong type",
        Asked("fan-1", "run_forward", args={"frequency": "fast"}),
        refused("wrong_type", "frequency takes a number, not 'fast'"),
        status="BadInvalidArgument",
    ),
    Row(
        "argument missing",
        Asked("fan-1", "run_forward", args={}),
        refused("wrong_arguments", "run_forward takes frequency; given: none"),
        status="BadArgumentsMissing",
    ),
    Row(
        "read-only",
        Asked("fan-1", "output_frequency", 10.0),
        refused("not_writable", "output_frequency is read-only"),
    ),
    Row(
        "unknown tag",
        Asked("fan-1", "frequency_comand", 10.0),
        refused("unknown_tag", "fan-1 has no point frequency_comand (did you mean frequency_command?)"),
    ),
    Row(
        "unknown command",
        Asked("fan-1", "fly", args={}),
        refused(
            "unknown_command",
            "fan-1 has no command fly (it has run_forward, run_reverse, stop, reset_fault)",
        ),
    ),
    Row(
        "danger without its words",
        Asked("fan-1", "access_level", 14),
        refused("danger", f"access_level: {HARM}; to do it, confirm with just these words: {HARM}"),
    ),
    Row(
        "lease of another",
        Asked("fan-2", "frequency_command", 10.0),
        refused(
            "lease",
            "fan-2 is held by berta (test), for 60 s unless he renews; "
            "stop is always allowed, engineer may take the lease",
        ),
        leased,
    ),
    Row(
        "precondition",
        Asked("fan-3", "run_forward", args={"frequency": 10.0}),
        refused(
            "precondition",
            "needs run_source: line, but it is operator_or_terminals (Sn-08: Whose run command counts)",
        ),
        local,
    ),
    Row(
        "22H of the drive",
        Asked("fan-3", "acceleration_time_1", 31),
        refused("drive_refused", f"the drive answered 22H locked: {LOCKED}"),
        undervoltage,
        status="BadInvalidState",
    ),
    Row(
        "maintenance",
        Asked("fan-2", "frequency_command", 10.0),
        refused(
            "maintenance",
            "fan-2 is in maintenance, switched on by berta (test): bearing; only a stop is let through",
        ),
        in_maintenance,
    ),
    Row(
        "silent",
        Asked("fan-3", "frequency_command", 10.0),
        Told("failed", "no_answer", "fan-3 does not answer"),
        unplugged,
    ),
]

OPERATOR_ROWS = [
    Row(
        "wrong role",
        Asked("fan-1", "motor_rated_current", 70),
        refused("no_rights", "operator may not do this; it takes engineer"),
        ways=("opcua", "mqtt"),
    )
]

OFF_ROWS = [
    Row(
        row.id,
        row.asked,
        refused("writes_disabled", "writing is off at this site (writes.enabled in the site file)"),
    )
    for row in ADMIN_ROWS
    if row.id in ("ok", "stop", "wrong type", "unknown tag", "unknown command")
]


async def compare(plant: Inside, row: Row) -> list[str]:
    """What is not as it should be when a row is asked for in every way."""
    problems = []
    for way in row.ways:
        if row.before is not None:
            await row.before(plant)
        known = len(plant.records())
        answer = await plant.through[way](row.asked)
        told = row.told
        if answer != (told if way != "opcua" else answer_of_opcua(row, told)):
            problems.append(f"{row.id} through {way}: {answer} instead of {told}")
        new = await plant.recorded(way, known)
        on_record = [words(entry["outcome"]) for entry in new if entry["what"] == row.asked.what]
        if on_record != [told] or len(new) != 1:
            problems.append(f"{row.id} through {way}: on record are {on_record} instead of {told}")
    return problems


def words(outcome: dict[str, str]) -> Told:
    return Told(outcome["verdict"], outcome.get("cause", ""), outcome.get("reason", ""))


def answer_of_opcua(row: Row, told: Told) -> tuple[str, ...]:
    """The StatusCode of an outcome; a method also tells verdict and reason."""
    outcome = Outcome(verdict=Verdict(told.verdict), cause=Cause(told.cause), reason=told.reason)
    status = row.status or outcome_status(outcome).name
    return (status,) if row.asked.args is None else (status, told.verdict, told.reason)


@pytest.mark.parametrize(
    ("role", "writes", "rows"),
    [
        pytest.param(Role.ADMIN, True, ADMIN_ROWS, id="admin"),
        pytest.param(Role.OPERATOR, True, OPERATOR_ROWS, id="operator"),
        pytest.param(Role.ADMIN, False, OFF_ROWS, id="writes off"),
    ],
)
async def test_r1_the_same_outcome_in_every_protocol_and_on_record(
    tmp_path: Path, role: Role, writes: bool, rows: list[Row]
) -> None:
    async with inside(tmp_path, role, writes) as plant:
        await seen(plant, "fan-3.running", False)
        problems = [problem for row in rows for problem in await compare(plant, row)]
    assert not problems, "\n".join(problems)
