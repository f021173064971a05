"""What stands in the place of what, for each fault that is planted by hand."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

from gateway.bridge.messages import Done
from gateway.core import guard, permits, sending, writing
from gateway.core.clients import Clients
from gateway.core.drive import Drive
from gateway.core.events import Recorded
from gateway.core.leases import Leases
from gateway.core.ledger import Ledger
from gateway.core.once import Once
from gateway.core.permits import Permits
from gateway.core.polling import Polling
from gateway.core.requests import Writes
from gateway.core.runner import Runner
from gateway.core.scribe import Scribe
from gateway.core.store import Store
from gateway.line.interface import Answered, BlockRead, Silent
from gateway.line.line import Line
from gateway.line.reachability import Probing
from gateway.line.resync import Suspicion
from gateway.line.schedule import Schedule
from gateway.line.units import Units
from gateway.tag import Instant, Outcome, Role, Verdict
from tests.core.faultydisk import FaultyFile

Plant = tuple[tuple[Any, str, Any], ...]
"""Owner, name, and what stands there instead."""


def instead(owner: Any, name: str, make: Callable[[Callable[..., Any]], Any]) -> tuple[Any, str, Any]:
    """Something made out of what was there."""
    return owner, name, make(getattr(owner, name))


def nothing(*args: Any, **more: Any) -> None:
    """Do nothing."""


# -- the wire


def _no_gap(plain: Callable[..., Any]) -> Callable[..., Any]:
    """The silence counts from the end of our own request, not of what was heard last."""

    def over(self: Line, done: Any, silent_since: float, now: float, job: int | None = None) -> None:
        plain(self, done, silent_since, now, job)
        self._free_at = max(now, done.ends + self.gap)

    return over


def _short_gap(plain: Callable[..., Any]) -> Callable[..., Any]:
    def over(self: Line, done: Any, silent_since: float, now: float, job: int | None = None) -> None:
        plain(self, done, silent_since, now, job)
        self._free_at = max(now, self._free_at - 0.3 * self.gap)

    return over


def _believes(self: Suspicion, request: Any, reply: Any, at: float, now: float) -> float:
    """Any answer is the answer."""
    return now


def _just_ask(self: Units, unit: Any, choice: Any, read: Any, now: float) -> Any:
    """Nothing is asked so that its answer looks unlike those that may still come."""
    return self._plain(choice)


def _all_but_last(plain: Callable[..., Any]) -> Callable[..., Any]:
    def replan(self: Schedule, *args: Any) -> None:
        plain(self, *args)
        if len(self._reads) > 1:
            self._reads.pop()

    return replan


# -- writes


def _confirmed(*args: Any) -> Generator[Any, Any, Outcome]:
    return Outcome(verdict=Verdict.CONFIRMED)
    yield  # it is a generator


def _twice(plain: Callable[..., Any]) -> Callable[..., Any]:
    """What is not answered is sent again."""

    def put(*args: Any) -> Generator[Any, Any, Any]:
        finished = yield from plain(*args)
        if isinstance(finished.result, Silent):
            finished = yield from plain(*args)
        return finished

    return put


def _silence_is_consent(plain: Callable[..., Any]) -> Callable[..., Any]:
    def put(*args: Any) -> Generator[Any, Any, Any]:
        finished = yield from plain(*args)
        return replace(finished, result=Answered()) if isinstance(finished.result, Silent) else finished

    return put


def _unrecorded(self: Runner, running: Any, effect: Any, now: float) -> None:
    """Frames go out without a record."""
    running.frames += 1
    running.recorded = running.frames
    running.wake = now if effect.patience is not None else None


def _told_again(plain: Callable[..., Any]) -> Callable[..., Any]:
    def finish(self: Writes, number: int, outcome: Outcome) -> None:
        waiter = self._pending[number].waiter
        plain(self, number, outcome)
        if waiter is not None and number % 7 == 0:
            self._clients.tell(waiter[0], Done(waiter[1], outcome))

    return finish


def _never_told(plain: Callable[..., Any]) -> Callable[..., Any]:
    def finish(self: Writes, number: int, outcome: Outcome) -> None:
        if outcome.verdict is Verdict.SUPERSEDED:
            self._pending[number].waiter = None
        plain(self, number, outcome)

    return finish


def _any_role(needed: Role | None, origin: Any, ceiling: Role) -> Role:
    return Role.ADMIN


def _always_first(plain: Callable[..., Any]) -> Callable[..., Any]:
    def first(self: Once, key: Any, *args: Any) -> bool:
        return plain(self, key, *args) or key not in self._waiting

    return first


# -- leases


def _other_lease(plain: Callable[..., Any]) -> Callable[..., Any]:
    """The lease of another drive is asked."""

    def mixed(self: Leases, drive: Drive, *args: Any) -> Any:
        names = list(self._drives)
        other = names[(names.index(drive.name) + 1) % len(names)]
        return plain(self, self._drives[other], *args)

    return mixed


def _early(self: Leases, drive: Drive) -> float:
    return self._now.mono + drive.config.control.ttl / 4


def _acts_at_once(plain: Callable[..., Any]) -> Callable[..., Any]:
    """After a restart every drive is stopped, or gets its setpoint."""

    def restore(self: Leases, kept: Any, now: Instant) -> None:
        plain(self, kept, now)
        for drive in self._drives.values():
            action = drive.config.control.on_expiry or "hold"
            if action != "hold":
                self._services.act(drive, action, "the gateway was started")

    return restore


# -- values


def _shifted(plain: Callable[..., Any]) -> Callable[..., Any]:
    """Words of one read are taken for those of the next register."""

    def read(self: Polling, drive: Drive, block: BlockRead, now: Instant) -> Any:
        if len(block.words) > 2:
            block = replace(block, words=(block.words[1], block.words[0], *block.words[2:]))
        return plain(self, drive, block, now)

    return read


def _later(plain: Callable[..., Any]) -> Callable[..., Any]:
    """A value is said to be of now, not of when it was heard."""

    def read(self: Polling, drive: Drive, block: BlockRead, now: Instant) -> Any:
        return plain(self, drive, replace(block, at=now.mono + 0.5), now)

    return read


def _kept(plain: Callable[..., Any]) -> Callable[..., Any]:
    """Everything that was ever told is kept."""

    def batch(self: Clients, session: int, samples: Any) -> None:
        self.__dict__.setdefault("_all", []).append(samples)
        plain(self, session, samples)

    return batch


# -- the journal


def _not_synced(plain: Callable[..., Any]) -> Callable[..., Any]:
    def append(self: Ledger, file: FaultyFile, entries: Any) -> None:
        safe = file._content.safe
        plain(self, file, entries)
        file._content.safe = safe

    return append


def _acknowledged(self: Scribe, problem: str) -> None:
    """What cannot be written is told to be written."""
    self._report([Recorded(waiting.record.number) for waiting in self.waiting])
    self.waiting.clear()


PLANTS: dict[str, Plant] = {
    "late answers are forgotten": ((Suspicion, "missed", nothing),),
    "the resynchronisation is skipped": ((Suspicion, "weigh", _believes), (Units, "_apart", _just_ask)),
    "the silence counts from our own request": (instead(Line, "_over", _no_gap),),
    "the silence is cut short": (instead(Line, "_over", _short_gap),),
    "a stop waits its turn": ((Schedule, "_next_stop", nothing),),
    "nothing expires": ((Schedule, "expired", lambda self, now: []),),
    "one demand is dropped": (instead(Schedule, "replan", _all_but_last),),
    "silent drives are not probed": ((Probing, "next", nothing),),
    "the read-back is dropped": ((writing, "read_back", _confirmed),),
    "the proof of commands is dropped": ((writing, "prove", _confirmed),),
    "silence is consent": (instead(sending, "put", _silence_is_consent),),
    "what is not answered is sent again": (instead(sending, "put", _twice),),
    "a stop is sent once": ((sending, "STOP_PAUSE", 1e6),),
    "two leases are mixed up": (instead(Leases, "check", _other_lease),),
    "leases go to whoever asks": ((Leases, "_check_available", nothing),),
    "a lease ends early": ((Leases, "_end_from_now", _early),),
    "a lease never ends": ((Leases, "tick", nothing), (Leases, "wake", nothing)),
    "leases and rights are not looked at again": (
        (Permits, "still", nothing),
        (Writes, "drop", nothing),
    ),
    "rights are not checked": ((permits, "check_rights", _any_role),),
    "ranges are not checked": ((guard, "check_range", nothing),),
    "frames do not wait for their record": ((sending, "RECORD_PATIENCE", None),),
    "frames have no record": ((Runner, "_intend", _unrecorded),),
    "the journal is not synced": (instead(Ledger, "_append", _not_synced),),
    "what cannot be written counts as written": ((Scribe, "_failed", _acknowledged),),
    "ids are forgotten over a restart": ((Once, "restore", nothing),),
    "an id that is done is new": (instead(Once, "first", _always_first),),
    "an outcome is told twice": (instead(Writes, "_finish", _told_again),),
    "an outcome is not told": (instead(Writes, "_finish", _never_told),),
    "every drive is commanded after a restart": (instead(Leases, "restore", _acts_at_once),),
    "old values stay good": ((Store, "aged", nothing),),
    "two registers are mixed up": (instead(Polling, "read", _shifted),),
    "values are newer than they are": (instead(Polling, "read", _later),),
    "what was told is kept": (instead(Clients, "batch", _kept),),
    "the rest of a word is not read first": ((Drive, "words_to_read", lambda self, raws: []),),
}
