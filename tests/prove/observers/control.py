"""What must hold of who commands a drive."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gateway.bridge.api import ControlState, LeaseAct
from gateway.bridge.messages import Call, ClientGone, DoLease, Response, RunCommand, WriteTag
from gateway.core.lease import same
from gateway.mapping.site import SETPOINT, DriveConfig
from gateway.tag import Origin, Role, Verdict
from tests.prove.observers.base import Observer
from tests.prove.seen import Frame

EXACT = 1e-6
LOOK = 0.5
"""Seconds between two looks at leases that should be over."""


class Holder(Observer):
    """A write goes out only for whoever holds the drive's lease, and a lease changes hands only when its
    holder gave it up, went away, lost it to an engineer, or did not renew it for its time to live."""

    name, hazard = "one client commands a drive", "H12 H10"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._drives = {drive.name: drive for drive in self.box.site.drives}
        self._reset()

    def _reset(self) -> None:
        self._state: dict[str, ControlState] = {}
        self._holder: dict[str, Origin] = {}
        self._touched: dict[str, float] = {}
        """When whoever holds a drive did something for it last."""
        self._free: set[str] = set()
        """Drives whose lease may go to anybody."""
        self._cut: set[str] = set()
        """Drives whose holder was cut off: he may return, under another session too."""
        self._began = self.now
        self._next_look = self.now + LOOK

    def began(self) -> None:
        self._reset()

    def asked(self, session: int, call: Call) -> None:
        match call:
            case ClientGone(_, origin, may_return):
                self._gone(lambda holder: same(holder, origin), self._cut if may_return else self._free)
            case DoLease(_, drive, LeaseAct.RELEASE, origin):
                if drive in self._holder and same(self._holder[drive], origin):
                    self._free.add(drive)
            case DoLease(_, drive, LeaseAct.TAKE, origin) if origin.role.covers(Role.ENGINEER):
                self._touch(drive, origin)
                self._free.add(drive)
            case DoLease(_, drive, _, origin):
                self._touch(drive, origin)
            case WriteTag(_, target, _, origin):
                self._touch(target.partition(".")[0], origin)
            case RunCommand(_, drive, _, _, origin):
                self._touch(drive, origin)

    def _touch(self, drive: str, origin: Origin, at: float = 0.0) -> None:
        holder = self._holder.get(drive)
        if holder is not None and same(holder, origin):
            self._touched[drive] = max(self.now, at)

    def stepped(self) -> None:
        if self.now < self._next_look or not self.box.clients.sessions:
            return
        self._next_look = self.now + LOOK
        for drive, holder in self._holder.items():
            idle = self.now - self._touched[drive]
            self.looked += 1
            if idle > self._drives[drive].control.ttl + LOOK:
                self.fail(f"{holder.who} is told to hold {drive}, {idle:.3f} s after he did anything")

    def left(self, session: int) -> None:
        self._gone(lambda holder: bool(holder.session), self._cut)

    def _gone(self, which: Callable[[Origin], bool], where: set[str]) -> None:
        where |= {drive for drive, holder in self._holder.items() if which(holder)}

    def told(self, session: int, message: Response) -> None:
        if not isinstance(message, ControlState):
            return
        drive, holder = message.drive, message.holder
        before = self._holder.get(drive)
        restored = drive not in self._state
        self._state[drive] = message
        if message.void or holder is None:
            self._holder.pop(drive, None)
            self._free.add(drive)
        if holder is None:
            return
        if before is not None and not same(before, holder):
            self.looked += 1
            self._goes_over(drive, before, holder)
        if before is None or not same(before, holder):
            self._free.discard(drive)
            (self._cut.add if restored else self._cut.discard)(drive)
            self._touched[drive] = self._began if restored else self.now
        self._holder[drive] = holder

    def _goes_over(self, drive: str, before: Origin, holder: Origin) -> None:
        """A lease went from one to the other."""
        ttl = self._drives[drive].control.ttl
        idle = self.now - self._touched.get(drive, self.now)
        returned = drive in self._cut and (before.through, before.who) == (holder.through, holder.who)
        if drive not in self._free and not returned and idle < ttl - EXACT:
            self.fail(f"{drive} went from {before.who} to {holder.who} after {idle:.3f} s of {ttl:g}")

    def sent(self, frame: Frame) -> None:
        intent = frame.intent
        if intent is None or intent.own or intent.stops or not intent.entry["what"]:
            return
        drive: DriveConfig = self._drives[intent.entry["drive"]]
        if drive.control.lease == "off":
            return
        self.looked += 1
        request = self.seen.request_of(frame)
        if request is None:
            return
        origin = request.ask.origin
        holder = self._holder.get(drive.name)
        told = self._state.get(drive.name)
        if told is None:  # nobody was connected to be told
            return
        idle = self.now - self._touched.get(drive.name, self.now)
        taken_back = not any(intent.entry["new"].values()) and len(request.frames) > 1
        if (holder is None or not same(holder, origin)) and not taken_back:
            held = holder.who if holder else "nobody"
            self.fail(f"{request.what} of {origin.who} is on the wire while {held} holds {drive.name}")
        elif idle > drive.control.ttl + EXACT and not taken_back:
            text = f"{request.what} of {origin.who} is on the wire {idle:.3f} s after he did anything"
            self.fail(f"{text}, with a lease of {drive.control.ttl:g} s")
        if isinstance(request.ask, RunCommand) and len(request.frames) == 1:
            self._touch(drive.name, origin, frame.end)  # a run may have waited for its turn


class Unasked(Observer):
    """What nobody asked for is not written, but for what follows the end of a lease, once, and what a site
    wants done about a drive that comes back running."""

    name, hazard = "nothing is written by itself", "H11 H10"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._drives = {drive.name: drive for drive in self.box.site.drives}

        self._ended: set[str] = set()
        """Drives on which the end of a lease left something to be done in this life."""
        self._before: set[str] = set()
        """Where the same was begun before and is not done yet, as the journal tells."""

    def began(self) -> None:
        leases = [entry for entry in self.box.safe.entries() if entry["kind"] == "lease"]
        last = {entry["drive"]: entry for entry in leases}
        self._before = {drive for drive, entry in last.items() if entry["due"]}
        self._ended = set()

    def recorded(self, number: int, entry: dict[str, Any]) -> None:
        if entry["kind"] == "lease" and entry["due"]:
            self._ended.add(entry["drive"])

    def sent(self, frame: Frame) -> None:
        intent = frame.intent
        if intent is None or self.seen.request_of(frame) is not None:
            return
        if intent.stops and not intent.own:
            return  # a stop through MQTT has no id
        self.looked += 1
        drive = self._drives[intent.entry["drive"]]
        if not intent.entry["what"]:
            return  # a selector, written to read something
        if not intent.own:
            self.fail(f"{intent.entry['what']} by {intent.entry['by']} was asked by nobody")
        elif not self._allowed(drive, intent.entry):
            self.fail(f"{intent.entry['what']} by itself ({intent.entry['by']['who']})")

    def _allowed(self, drive: DriveConfig, entry: dict[str, Any]) -> bool:
        if drive.control.on_reappear != "stop" and drive.name not in self._ended | self._before:
            return False
        action = drive.control.on_expiry or "hold"
        what = entry["what"].partition(".")[2]
        if what == "stop":  # which also follows a setpoint that is not confirmed
            return action != "hold" or drive.control.on_reappear == "stop"
        return action.startswith("setpoint") and what == SETPOINT and entry["wanted"] == 5.0


class Bits(Observer):
    """Two clients' bits in one control word are never lost: of a word that more than one point shares, a
    write changes what was asked and nothing else."""

    name, hazard = "no bit of another is lost", "H7"

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._drives = {(d.line, d.unit): d for d in self.box.site.drives}
        self._changed: dict[tuple[str, int, int], float] = {}
        """When somebody else than the core changed a word last."""

    def did(
        self, line: str, unit: int, frame: Frame | None, before: dict[int, int], after: dict[int, int]
    ) -> None:
        drive = self._drives[line, unit]
        if frame is None:
            self._changed |= {(line, unit, at): self.now for at in after}
            return
        intent = frame.intent
        if intent is None or intent.stops or not intent.entry["what"]:
            return
        for address, word in after.items():
            shared = [
                p
                for p in drive.profile.points.values()
                if p.address == address and p.encoding.width and p.access.readable and p.access.writable
            ]
            if len(shared) < 2 or address not in before:
                continue
            mine = set(intent.entry["new"])
            self.looked += 1
            for point in shared:
                if point.name in mine or point.pulse:
                    continue
                mask = ((1 << point.encoding.width) - 1) << point.encoding.bit
                if (word ^ before[address]) & mask and not self._meanwhile(line, unit, address, frame):
                    text = f"{intent.entry['what']} turned {point.name} of {drive.name}"
                    self.fail(f"{text}: {before[address]:04X} became {word:04X}")

    def _meanwhile(self, line: str, unit: int, address: int, frame: Frame) -> bool:
        """The drive was switched off and on, or somebody else wrote, after the word was read last."""
        station = self.box.buses[line].stations[unit]
        read = max(
            (
                f.at
                for f in self.seen.frames[line]
                if f.unit == unit and f.at < frame.at and f.covers(address, 1)
            ),
            default=-1.0,
        )
        others = max(self._changed.get((line, unit, address), -1.0), station.restarted)
        return others >= read


__all__ = ["Bits", "Holder", "Unasked", "Verdict"]
