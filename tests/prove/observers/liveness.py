"""What must hold once nothing goes wrong any more, and how much may pile up."""

from __future__ import annotations

import gc
import sys
from collections import Counter, deque
from typing import Any

from gateway.bridge.api import Batch, DriveState, Happened, LeaseAct, Periods
from gateway.bridge.messages import Call, DoLease, Done, Promised, Response, Watch, WriteTag
from gateway.core.attempts import Attempts
from gateway.core.core import Core
from gateway.line.trace import Trace
from gateway.tag import Origin, Quality, Role, Sample, Verdict, is_own, split_tag
from tests.prove.observers.base import Observer
from tests.prove.observers.values import drive_of
from tests.prove.scene import CALM_SECONDS
from tests.prove.site import SETPOINT

ERIKA = Origin(through="opcua", who="erika", role=Role.ENGINEER, session="last")
PROBED_AFTER = 70.0
"""Seconds without faults after which each drive obeys again."""
PROBE_LASTS = 1.5
HICCUP = 2.0
BE_PATIENT = 40.0
"""Seconds: what is promised more seldom may be lost once more after the last fault, and not be read again
before the world ends."""
VALUE = 7.0
HEAVY = 150_000
"""Objects that a core may hold at most."""
LONG = 1_500
"""Things in one list, dict or set of it; in a world there are tens of thousands of steps."""
ROOM = (Trace, Attempts)
"""What may hold more: the last frames of a line, and the ids of commands (`KEEP_SENT`)."""


class Recovers(Observer):
    """Within stated bounds after the last fault every drive is seen, every wanted value is good, and an
    engineer who takes a drive is obeyed."""

    name, hazard = "everything recovers", "H8"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._last: dict[tuple[int, str], Sample] = {}
        self._up: dict[str, bool] = {}
        self._promised: dict[str, float] = {}
        self._alarms: set[str] = set()
        self._outcomes: dict[str, list[Any]] = {}
        self._ids: dict[int, str] = {}
        clock, begin = self.box.clock, self.box.scene.seconds
        clock.at(begin + PROBED_AFTER, lambda: self._probe("take"))
        clock.at(begin + PROBED_AFTER + PROBE_LASTS, lambda: self._probe("write"))
        clock.at(begin + CALM_SECONDS - 0.01, self._look)

    def died(self) -> None:
        self._last.clear()
        self._promised.clear()
        self._up.clear()
        self._alarms.clear()

    def left(self, session: int) -> None:
        self._last = {key: sample for key, sample in self._last.items() if key[0] != session}

    def asked(self, session: int, call: Call) -> None:
        if isinstance(call, Watch):
            gone = {tag for tag, period in call.wants.items() if period is None}
            self._last = {k: s for k, s in self._last.items() if k[0] != session or k[1] not in gone}

    def told(self, session: int, message: Response) -> None:
        match message:
            case Promised(_, periods) | Periods(periods):
                self._promised |= periods
            case Batch():
                for sample in message.samples:
                    self._last[session, sample.tag] = sample
            case DriveState(drive, up):
                self._up[drive] = up
            case Done(id, outcome) if id in self._ids:
                self._outcomes.setdefault(self._ids.pop(id), []).append(outcome)
            case Happened(event) if event.alarm:
                (self._alarms.discard if event.name == "alarm_cleared" else self._alarms.add)(event.alarm)

    def _probe(self, what: str) -> None:
        clients = self.box.clients
        for drive in self.box.site.drives:
            number = clients.next_id()
            self._ids[number] = f"{drive.name} {what}"
            if what == "take":
                clients.ask("opcua", DoLease(number, drive.name, LeaseAct.TAKE, ERIKA, ""))
            else:
                tag = f"{drive.name}.{SETPOINT}"
                clients.commit("opcua", WriteTag(number, tag, VALUE, ERIKA, 5.0, f"last-{number}"))

    def _look(self) -> None:
        box = self.box
        if box.core is None:
            self.fail("the core does not run")
            return
        for drive in box.site.drives:
            self.looked += 1
            if self._up.get(drive.name) is not True:
                self.fail(f"{drive.name} is not seen")
        for (_, tag), sample in self._last.items():
            if is_own(tag) or self._promised.get(tag, 0.0) > BE_PATIENT:
                continue
            self.looked += 1
            if self._is_lost(sample) and not self._hangs_on_slower(tag):
                self.fail(f"{tag} is {sample.quality}: {sample.reason}")
        for name in [f"{d.name} {what}" for d in box.site.drives for what in ("take", "write")]:
            outcomes = self._outcomes.get(name, [])
            self.looked += 1
            if not outcomes:
                self.fail(f"{name}: no outcome")
            elif outcomes[0].verdict is not Verdict.CONFIRMED and not self._excused(name, outcomes[0]):
                self.fail(f"{name}: {outcomes[0]}")

    def _is_lost(self, sample: Sample) -> bool:
        """A value may be a little late even then, as long as it shows."""
        if sample.quality is not Quality.STALE:
            return sample.quality in LOST
        age = self.now - self.box.moment_of(sample.time)
        return age > 5 * self._promised.get(sample.tag, 0.0) + HICCUP

    def _hangs_on_slower(self, tag: str) -> bool:
        """What it means depends on others that are read more seldom, on a line that is too full."""
        drive = drive_of(self.box, tag)
        slow = {
            t
            for t, period in self._promised.items()
            if t.startswith(f"{drive.name}.") and period > BE_PATIENT
        }
        point = drive.profile.points[split_tag(tag)[1]]
        return bool(slow and (point.cases or point.when or point.encoding.times))

    def _excused(self, name: str, outcome: Any) -> bool:
        """A drive in the hands of its panel takes no setpoint."""
        return bool(outcome.cause == "precondition" or outcome.cause == "drive_refused")


LOST = (Quality.STALE, Quality.NO_COMMUNICATION, Quality.LINE_DOWN, Quality.WAITING)


class Bounded(Observer):
    """However long it goes on, nothing piles up in the core."""

    name, hazard = "queues and memory are bounded", "D2"

    def ended(self) -> None:
        self.looked += 1
        weight, long = _weight(self.box.core, self.box)
        if weight > HEAVY:
            self.fail(f"the core holds {weight} objects")
        if long:
            grown = long - _weight(Core(self.box.site, "new"), self.box)[1]
            if grown:
                self.fail(f"the core holds {max(grown)} things in one place")


def _weight(root: Any, world: Any) -> tuple[int, Counter[int]]:
    """The number of objects that hang on one, and the lengths of things longer than `LONG`; types, modules,
    what only hangs on a module, and the world around it not counted."""
    seen = {
        id(root),
        id(world),
        *(id(vars(module)) for module in list(sys.modules.values()) if module is not None),
    }
    others = len(seen) - 2
    stack, long, roomy = [root], Counter[int](), set[int]()
    while stack:
        for each in gc.get_referents(stack.pop()):
            if id(each) not in seen and not isinstance(each, type) and type(each).__name__ != "module":
                seen.add(id(each))
                stack.append(each)
                if isinstance(each, list | dict | set | deque) and len(each) > LONG and id(each) not in roomy:
                    long[len(each)] += 1
                if isinstance(each, ROOM):
                    roomy |= {id(part) for part in gc.get_referents(each)}
    return len(seen) - others, long
