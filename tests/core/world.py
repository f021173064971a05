"""The whole core with simulated drives, journal and clients, in one thread on a virtual clock.

The wire and the drives are those of `gateway.simulator`, whose framing is written apart from the
core's. Nothing sleeps: time jumps from one thing that is due to the next.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from gateway.bridge.api import Batch, ControlState, DriveState, Happened, LeaseAct
from gateway.bridge.messages import (
    Act,
    ClientGone,
    DoLease,
    Done,
    Maintain,
    Promised,
    ReadTags,
    Response,
    RunCommand,
    Samples,
    Watch,
    WriteTag,
)
from gateway.core.core import Core
from gateway.core.events import (
    Asked,
    Close,
    Event,
    Joined,
    Left,
    Open,
    PortLost,
    PortOpened,
    Received,
    Record,
    Recorded,
    Started,
    Tell,
    Ticked,
    Transmit,
)
from gateway.core.memory import Memory
from gateway.core.runs import Boot
from gateway.mapping.load import builtin_mappings, load_profile
from gateway.mapping.profile import Pace, Profile, SerialFormat
from gateway.mapping.site import Control, DriveConfig, LineConfig, Rs485, Site, StartGroup
from gateway.mapping.specialise import specialise
from gateway.simulator.adapter import LatencyTimer
from gateway.simulator.build import build_drives, wire_timing
from gateway.simulator.happening import Options
from gateway.simulator.line import Line as SimulatedLine
from gateway.tag import Instant, Origin, Outcome, Role, Sample, Value

START = 1_700_000_000 * 10**9
RESTART_SECONDS = 0.2
ENGINEER = Origin(through="test", who="erika", role=Role.ENGINEER)
OPERATOR = Origin(through="test", who="otto", role=Role.OPERATOR)


@cache
def teco() -> Profile:
    """The shipped profile of the 7200GS."""
    profile, findings = load_profile(builtin_mappings() / "teco-7200gs.yaml")
    assert profile is not None, findings
    return profile


FREE_FOR_ALL = Control(lease="off")


def make_site(
    drives: int = 1,
    *,
    writes: bool = True,
    first_unit: int = 5,
    baud: int = 9600,
    control: Control = FREE_FOR_ALL,
    limits: Mapping[str, Pace] = MappingProxyType({}),
    starts: tuple[StartGroup, ...] = (),
) -> Site:
    """A site with one line and so many 7200GS: fan-1 at unit 5, fan-2 at unit 6 ..."""
    settings = {name: s.default for name, s in teco().settings.items() if s.default is not None}
    configs = tuple(
        DriveConfig(
            name=f"fan-{n + 1}",
            line="north",
            profile=teco(),
            unit=first_unit + n,
            settings=settings,
            ranges={"frequency_command": (Fraction(0), Fraction(60))},
            control=control,
            limits=limits,
        )
        for n in range(drives)
    )
    line = LineConfig(
        name="north",
        port="simulated:",
        framing="rtu",
        baud=baud,
        format=SerialFormat(8, "N", 2),
        rs485=Rs485(),
        drives=configs,
    )
    return Site(
        site="plant7",
        gateway="gw1",
        path=Path("site.yaml"),
        lines=(line,),
        rates={"fast": 0.2, "normal": 1.0, "slow": 30.0},
        writes_enabled=writes,
        data=Path("data"),
        opcua=None,
        mqtt=(),
        starts=starts,
        digest="0" * 64,
    )


def site_of(
    profile_name: str, *, framing: Literal["rtu", "ascii"] = "rtu", writes: bool = True, **settings: Fraction
) -> Site:
    """A site with one drive, drive-1 at unit 1, of any shipped profile, on a line in its factory format."""
    profile, findings = load_profile(builtin_mappings() / f"{profile_name}.yaml")
    assert profile is not None, findings
    known = {name: s.default for name, s in profile.settings.items() if s.default is not None} | settings
    special = specialise(profile, known)
    drive = DriveConfig(
        name="drive-1", line="north", profile=special, unit=1, settings=known, control=FREE_FOR_ALL
    )
    formats = profile.serial.rtu if framing == "rtu" else profile.serial.ascii
    line = LineConfig(
        name="north",
        port="simulated:",
        framing=framing,
        baud=9600,
        format=formats[0],
        rs485=Rs485(),
        drives=(drive,),
    )
    return replace(make_site(writes=writes), lines=(line,))


class World:
    """A core, its line, and whatever the test does to them. Times are virtual seconds since start.

    Args:
        journal_delay: seconds until a journal entry is on disk.
        memory: what the journal of an earlier world remembers (`World.memory`): this one is its restart.
        twins: the site as its drives really are, where that is not what the gateway was told.
    """

    def __init__(
        self,
        site: Site | None = None,
        journal_delay: float = 0.002,
        memory: Memory | None = None,
        twins: Site | None = None,
        **options: Any,
    ) -> None:
        self.site = site or make_site()
        self.core = Core(self.site, "test")
        self.now = 0.0
        self.told: dict[int, list[Response]] = {}
        self.journal: list[dict[str, Any]] = []
        self.journal_problem = ""
        self.journal_delay = journal_delay
        self._kept: list[Record] = []
        self._retry = math.inf
        self.port_problem = ""
        self.wire: list[tuple[float, str]] = []
        self._later: list[tuple[float, Event]] = []
        self._last_request = 0
        config = (twins or self.site).lines[0]
        drives = build_drives(config, {d.name: Options(**options) for d in config.drives})
        self.drives = drives
        self.simulated = SimulatedLine(wire_timing(config), drives.values())
        self.adapter = LatencyTimer()
        self.feed(Started(memory or Memory(), Boot(id="boot", machine="machine")))
        self.session = self.join()

    def memory(self) -> Memory:
        """What is remembered of this world when it is ended here and now."""
        memory = Memory()
        for entry in self.journal:
            memory.fold(entry)
        return memory.copy()

    # -- clients

    def join(self, name: str = "test", ceiling: Role = Role.ADMIN) -> int:
        session = len(self.told) + 1
        self.told[session] = []
        self.feed(Joined(session, name, ceiling))
        return session

    def leave(self, session: int) -> None:
        self.feed(Left(session))

    def watch(self, wants: dict[str, float | None], session: int | None = None) -> dict[str, float]:
        request = Watch(self._next_request(), wants)
        self.feed(Asked(session or self.session, request))
        [reply] = [
            m for m in self.told[session or self.session] if isinstance(m, Promised) and m.id == request.id
        ]
        return dict(reply.periods)

    def ask_write(
        self,
        tag: str,
        value: Value,
        origin: Origin = ENGINEER,
        ttl: float = 5.0,
        key: str = "",
        session: int | None = None,
        confirm: str = "",
    ) -> Callable[[], Outcome | None]:
        request = WriteTag(self._next_request(), tag, value, origin, ttl, key, confirm)
        return self._ask(request, session or self.session)

    def ask_command(
        self,
        name: str,
        drive: str = "fan-1",
        origin: Origin = OPERATOR,
        ttl: float = 5.0,
        key: str = "",
        session: int | None = None,
        **args: Value,
    ) -> Callable[[], Outcome | None]:
        request = RunCommand(self._next_request(), drive, name, args, origin, ttl, key)
        return self._ask(request, session or self.session)

    def write(self, tag: str, value: Value, origin: Origin = ENGINEER, **more: Any) -> Outcome:
        return self.until(self.ask_write(tag, value, origin, **more), 30.0)

    def command(self, name: str, origin: Origin = OPERATOR, **more: Any) -> Outcome:
        return self.until(self.ask_command(name, origin=origin, **more), 90.0)

    def read(self, *tags: str, max_age: float = 0.0) -> list[Sample]:
        request = ReadTags(self._next_request(), tags, max_age)
        self.feed(Asked(self.session, request))

        def answer() -> list[Sample] | None:
            found = [m for m in self.told[self.session] if isinstance(m, Samples) and m.id == request.id]
            return list(found[0].samples) if found else None

        return self.until(answer, 10.0)

    def samples(self, tag: str, session: int | None = None) -> list[Sample]:
        """Every sample of a tag that a client was told, in order."""
        batches = [m for m in self.told[session or self.session] if isinstance(m, Batch)]
        return [sample for batch in batches for sample in batch.samples if sample.tag == tag]

    def events(self) -> list[str]:
        return [m.event.name for m in self.told[self.session] if isinstance(m, Happened)]

    def states(self) -> list[tuple[str, bool]]:
        return [(m.drive, m.up) for m in self.told[self.session] if isinstance(m, DriveState)]

    def sent(self, function: str = "10") -> list[str]:
        """The requests on the wire with this function code, as hex text."""
        return [frame for _, frame in self.wire if frame.split()[1] == function]

    def lease(
        self,
        act: LeaseAct,
        origin: Origin = OPERATOR,
        drive: str = "fan-1",
        session: int | None = None,
        whom: str = "",
    ) -> Outcome:
        request = DoLease(self._next_request(), drive, act, origin, whom)
        return self.until(self._ask(request, session or self.session), 5.0)

    def gone(self, origin: Origin, *, may_return: bool = False) -> Outcome:
        request = ClientGone(self._next_request(), origin, may_return)
        return self.until(self._ask(request, self.session), 5.0)

    def maintain(self, on: bool, origin: Origin = ENGINEER, reason: str = "") -> Outcome:
        request = Maintain(self._next_request(), "fan-1", on, origin, reason)
        return self.until(self._ask(request, self.session), 5.0)

    def control(self, drive: str = "fan-1", session: int | None = None) -> ControlState:
        """What a client was told last about who may command a drive."""
        told = self.told[session or self.session]
        return [m for m in told if isinstance(m, ControlState) and m.drive == drive][-1]

    def restart(self) -> None:
        """The gateway is killed and starts again; the drives notice nothing, and what they still answer the
        one that was killed is over before the new one speaks."""
        memory, self._later = self.memory(), []
        self.now += RESTART_SECONDS
        self.simulated.advance(self.now)
        self.core = Core(self.site, "test")
        self.feed(Started(memory, Boot(id=f"boot-{self.now}", machine="machine")))
        self.session = self.join()

    # -- time

    def run(self, seconds: float) -> None:
        """Let virtual time pass."""
        end = self.now + seconds
        while self._next_due() <= end:
            self._step()
        self.now = end

    def until(self, condition: Callable[[], Any], seconds: float) -> Any:
        """Let time pass until the condition gives something; fails after so many seconds."""
        end = self.now + seconds
        while (found := condition()) is None or found is False:
            assert self._next_due() <= end, f"not within {seconds} s"
            self._step()
        return found

    def feed(self, event: Event) -> None:
        for action in self.core.step(event, self.instant()):
            self._carry_out(action)

    def instant(self) -> Instant:
        return Instant(self.now, START + round(self.now * 1e9))

    def _next_due(self) -> float:
        wake = self.core.wake()
        times = [self.simulated.due(), self.adapter.due(), self._retry, *(at for at, _ in self._later)]
        return max(self.now, min(times if wake is None else [wake, *times]))

    def _step(self) -> None:
        self.now = self._next_due()
        for item in [item for item in self._later if item[0] <= self.now]:
            self._later.remove(item)
            self.feed(item[1])
        if self._retry <= self.now:
            self._write_kept()
        data = self.adapter.take(self.simulated.advance(self.now), self.now)
        if data and not self.port_problem:
            self.feed(Received("north", data))
        wake = self.core.wake()
        if wake is not None and wake <= self.now:
            ahead = [action.data.hex(" ").upper() for action in self.core.look_ahead(self.now)]
            before = len(self.wire)
            self.feed(Ticked())
            assert ahead in ([], [data for _, data in self.wire[before:]][:1]), (
                "what was foretold was not sent"
            )

    def _carry_out(self, action: Any) -> None:
        match action:
            case Transmit(_, data):
                self.wire.append((self.now, data.hex(" ").upper()))
                self.simulated.receive(data, self.now)
            case Tell(session, message):
                self.told[session].append(message)
            case Record():
                self._record(action)
            case Open(line):
                event = PortLost(line, self.port_problem) if self.port_problem else PortOpened(line)
                self._later.append((self.now + 0.001, event))
            case Close():
                pass

    def _record(self, record: Record) -> None:
        """As the journal's thread does it: what is to be kept is written later if it cannot be now, and then
        before anything newer."""
        if self._kept and not self.journal_problem:
            self._write_kept()
        self._later.append((self.now + self.journal_delay, Recorded(record.number, self.journal_problem)))
        if not self.journal_problem:
            self.journal.append({"at": self.now, **record.entry})
        elif record.keep:
            self._kept.append(record)
            self._retry = self.now + 1.0

    def _write_kept(self) -> None:
        kept, self._kept, self._retry = self._kept, [], math.inf
        for record in kept:
            self._record(record)

    def _ask(self, request: Act, session: int) -> Callable[[], Outcome | None]:
        self.feed(Asked(session, request))

        def outcome() -> Outcome | None:
            done = [m.outcome for m in self.told[session] if isinstance(m, Done) and m.id == request.id]
            assert len(done) <= 1, "an outcome was told twice"
            return done[0] if done else None

        return outcome

    def _next_request(self) -> int:
        self._last_request += 1
        return self._last_request
