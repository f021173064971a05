"""A bridge that answers from memory, for testing adapters without a core."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping, Sequence
from typing import Any

from gateway.bridge.api import (
    DIAGNOSTIC,
    ArgumentInfo,
    Batch,
    Catalogue,
    CommandInfo,
    ControlState,
    DriveInfo,
    Health,
    LeaseAct,
    OwnerInfo,
    PointInfo,
    TracePage,
    Update,
)
from gateway.tag import Cause, Origin, Outcome, Quality, Role, Sample, Value, ValueType, Verdict, split_tag


def small_catalogue(drive: str = "fan-1") -> Catalogue:
    """One drive with a point of each kind that northbounds treat differently."""
    points = (
        PointInfo(
            name="running",
            group="monitor",
            kind="status",
            type=ValueType.BOOLEAN,
            rate="fast",
            register="0020H.0",
        ),
        PointInfo(
            name="output_frequency",
            group="monitor",
            kind="measurement",
            type=ValueType.NUMBER,
            rate="fast",
            unit="Hz",
            step=0.01,
            register="0024H",
            source="sim 9.2",
        ),
        PointInfo(
            name="output_voltage",
            group="monitor",
            kind="measurement",
            type=ValueType.NUMBER,
            rate="normal",
            unit="V",
            step=1.0,
            register="0028H",
        ),
        PointInfo(
            name="scan_count",
            group="monitor",
            kind="measurement",
            type=ValueType.INTEGER,
            rate="normal",
            register="002BH",
        ),
        PointInfo(
            name="fault_overcurrent",
            group="monitor",
            kind="fault",
            type=ValueType.BOOLEAN,
            rate="normal",
            register="0021H.0",
        ),
        PointInfo(
            name="run_source",
            group="sn",
            kind="parameter",
            type=ValueType.INTEGER,
            rate="slow",
            values={0: "line", 1: "operator_or_terminals"},
            writable=True,
            role=Role.ENGINEER,
            register="Sn-08.1",
        ),
        PointInfo(
            name="frequency_command",
            group="control",
            kind="setpoint",
            type=ValueType.NUMBER,
            rate="normal",
            unit="Hz",
            step=0.01,
            low=0.0,
            high=60.0,
            writable=True,
            role=Role.OPERATOR,
            register="0002H",
        ),
        PointInfo(
            name="input_5",
            group="control",
            kind="switch",
            type=ValueType.BOOLEAN,
            rate="normal",
            writable=True,
            role=Role.OPERATOR,
            register="0001H.4",
        ),
        PointInfo(
            name="run",
            group="control",
            kind="command",
            type=ValueType.BOOLEAN,
            rate="normal",
            role=Role.OPERATOR,
            register="0001H.0",
        ),
        PointInfo(
            name="_timeouts",
            group="diagnostics",
            kind=DIAGNOSTIC,
            type=ValueType.INTEGER,
            rate="normal",
            help="Requests without any reply",
        ),
        PointInfo(name="_locked", group="lease", kind=DIAGNOSTIC, type=ValueType.BOOLEAN, rate="normal"),
        PointInfo(name="_lease_holder", group="lease", kind=DIAGNOSTIC, type=ValueType.TEXT, rate="normal"),
    )
    frequency = ArgumentInfo(
        name="frequency", point="frequency_command", type=ValueType.NUMBER, unit="Hz", low=0.0, high=60.0
    )
    commands = (
        CommandInfo(name="run_forward", args=(frequency,)),
        CommandInfo(name="run_reverse", args=(frequency,)),
        CommandInfo(name="stop"),
        CommandInfo(name="reset_fault"),
    )
    info = DriveInfo(
        name=drive,
        line="north",
        unit=1,
        profile="teco-7200gs",
        title="TECO 7200GS",
        maker="TECO",
        model="7200GS",
        points=points,
        commands=commands,
    )
    utilisation = PointInfo(
        name="utilisation",
        group="diagnostics",
        kind=DIAGNOSTIC,
        type=ValueType.NUMBER,
        rate="normal",
        unit="%",
    )
    line = OwnerInfo(
        name="_north",
        browse="north",
        topic="plant7/_gateway/gw1/lines/north",
        title="Line north",
        points=(utilisation,),
        commands=(CommandInfo(name="stop_all"), CommandInfo(name="run_forward_all")),
    )
    return Catalogue(
        site="plant7",
        gateway="gw1",
        version="0",
        generation=1,
        digest="d" * 64,
        rates={"fast": 0.2, "normal": 1.0, "slow": 30.0},
        writes_enabled=True,
        drives=(info,),
        lines=(line,),
    )


class FakeBridge:
    """Implements `gateway.bridge.api.Bridge`. Tests put updates in with `push` and read what was
    wanted, written and commanded from the public attributes; `outcome` is what every write gets,
    after `delay` seconds."""

    def __init__(self, catalogue: Catalogue | None = None, section: Mapping[str, Any] | None = None) -> None:
        self.catalogue = catalogue or small_catalogue()
        self.section: Mapping[str, Any] = section or {}
        self.wants: dict[str, float] = {}
        self.writes: list[tuple[str, Value, Origin, float, str]] = []
        self.commands: list[tuple[str, str, dict[str, Value], Origin, float, str]] = []
        self.turned: list[tuple[str, Any, Origin, Outcome]] = []
        self.confirmed: list[str] = []
        """What was confirmed, of each write and command in order."""
        self.leases: list[tuple[str, LeaseAct, Origin, str]] = []
        self.departed: list[tuple[Origin, bool]] = []
        self.maintained: list[tuple[str, bool, Origin, str]] = []
        self.outcome = Outcome(verdict=Verdict.CONFIRMED)
        self.delay = 0.0
        self.least_period = 0.1
        self.samples: dict[str, Sample] = {}
        self.closed = False
        self._queue: asyncio.Queue[Update | None] = asyncio.Queue()
        self._seq = 0

    def _knows(self, owner: str, name: str) -> bool:
        """As the core, which refuses what is not there."""
        [found] = [known for known in self.catalogue.owners if known.name == owner]
        return name in [point.name for point in found.points] + [each.name for each in found.commands]

    def push(self, *samples: Sample) -> None:
        """Deliver samples as one batch."""
        self._seq += 1
        for sample in samples:
            self.samples[sample.tag] = sample
        self._queue.put_nowait(Batch(self._seq, samples))

    def push_update(self, update: Update) -> None:
        """Deliver any other update."""
        self._queue.put_nowait(update)

    async def watch(self, wants: Mapping[str, float | None]) -> Mapping[str, float]:
        known = {f"{d.name}.{p.name}" for d in self.catalogue.drives for p in d.points}
        promised = {}
        for tag, period in wants.items():
            if period is None:
                self.wants.pop(tag, None)
            elif tag in known:
                self.wants[tag] = period
                promised[tag] = max(period, self.least_period)
                if tag in self.samples:
                    self.push(self.samples[tag])
                else:
                    self.push(Sample(tag, None, Quality.WAITING, 1, reason="no value yet"))
        return promised

    async def updates(self) -> AsyncIterator[Update]:
        while (update := await self._queue.get()) is not None:
            yield update

    async def read(self, tags: Sequence[str], max_age: float = 0.0) -> Sequence[Sample]:
        return [self.samples.get(t, Sample(t, None, Quality.WAITING, 1, reason="no value yet")) for t in tags]

    async def write(
        self,
        tag: str,
        value: Value,
        origin: Origin,
        ttl: float = 5.0,
        id: str = "",
        confirm: str = "",
    ) -> Outcome:
        if not self._knows(*split_tag(tag)):
            return Outcome(verdict=Verdict.REFUSED, cause=Cause.UNKNOWN_TAG, reason=f"there is no {tag}")
        self.confirmed.append(confirm)
        self.writes.append((tag, value, origin, ttl, id))
        await asyncio.sleep(self.delay)
        return self.outcome

    async def command(
        self,
        drive: str,
        name: str,
        args: Mapping[str, Value],
        origin: Origin,
        ttl: float = 5.0,
        id: str = "",
        confirm: str = "",
    ) -> Outcome:
        if not self._knows(drive, name):
            reason = f"{drive} has no command {name}"
            return Outcome(verdict=Verdict.REFUSED, cause=Cause.UNKNOWN_COMMAND, reason=reason)
        self.confirmed.append(confirm)
        self.commands.append((drive, name, dict(args), origin, ttl, id))
        await asyncio.sleep(self.delay)
        return self.outcome

    async def lease(self, drive: str, act: LeaseAct, origin: Origin, whom: str = "") -> Outcome:
        self.leases.append((drive, act, origin, whom))
        return self.outcome

    async def gone(self, origin: Origin, may_return: bool) -> Outcome:
        self.departed.append((origin, may_return))
        return self.outcome

    async def controls(self) -> Sequence[ControlState]:
        return [ControlState(drive=drive.name) for drive in self.catalogue.drives]

    async def maintain(self, drive: str, on: bool, origin: Origin, reason: str = "") -> Outcome:
        self.maintained.append((drive, on, origin, reason))
        return self.outcome

    async def health(self) -> Health:
        return Health(started=1, lines=(), drives={}, sessions=())

    def turned_away(self, what: str, wanted: Any, origin: Origin, outcome: Outcome) -> None:
        self.turned.append((what, wanted, origin, outcome))

    async def acknowledge(self, alarm: str, origin: Origin) -> Outcome:
        return self.outcome

    async def trace(self, line: str, after: int = 0) -> TracePage:
        return TracePage(first=1, frames=(), last=0)

    async def close(self) -> None:
        self.closed = True
        self._queue.put_nowait(None)


REFUSED = Outcome(verdict=Verdict.REFUSED, cause=Cause.OUT_OF_RANGE, reason="above 60 Hz")
