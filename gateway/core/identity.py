"""Is the drive at an address of the model that the site says (S4)? Pure.

Where the profile knows registers that tell, nothing else of a drive is believed and nothing but a stop is
written to it until they were read and match; they are read at each first contact. Other drives are shown as
unverified.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from typing import Any

from gateway.core.alarms import Alarms
from gateway.core.commloss import AWAY, Read
from gateway.core.conditions import holds, shown_as
from gateway.core.drive import Drive
from gateway.core.establishing import fresh_sample
from gateway.core.guard import refuse
from gateway.core.own import OwnTags
from gateway.core.procedure import Effect
from gateway.core.store import Store
from gateway.mapping.own import OF_A_DRIVE
from gateway.tag import Cause, Instant, Quality, Sample

ALARM = "identity"
TAG = "_identity"
"""The point that tells in words how sure the model is."""

UNVERIFIED, VERIFIED = "unverified", "verified"
NOT_READ = "not identified yet"


def identified(drive: Drive, store: Store, now: float) -> Generator[Effect, Any, None]:
    """A part of a procedure: go on only if the drive is of the model that the site says.

    Raises:
        Ended: if it is not, or cannot be told.
    """
    if not drive.doubt:
        return
    for term in drive.profile.modbus.identity:
        why = f"nothing but a stop is written to {drive.name}: its model is told by {term.name}"
        yield from fresh_sample(drive, store, drive.profile.points[term.name], now, why)
    drive.doubt = doubt_about(drive, store)
    if drive.doubt:
        raise refuse(Cause.PRECONDITION, f"nothing but a stop is written to {drive.name}: {drive.doubt}")


def doubt_about(drive: Drive, store: Store) -> str:
    """What the drive shows against its being of its model; empty when it matches."""
    for term in drive.profile.modbus.identity:
        held = store.get(drive.tag(term.name))
        if held is None or held.sample.quality is not Quality.GOOD:
            return NOT_READ
        if not holds(term, held.sample.value):
            wanted = term.text.removeprefix(f"{term.name}: ")
            shows = shown_as(held.sample)
            return f"{term.name} shows {shows}, and {drive.profile.name} has {wanted}: another model answers"
    return ""


class Identities:
    """Identifies all drives. ``read`` reads tags once."""

    def __init__(
        self, drives: Iterable[Drive], store: Store, alarms: Alarms, own: OwnTags, read: Read
    ) -> None:
        self._store = store
        self._alarms = alarms
        self._own = own
        self._read = read
        self._now = Instant(0.0, 0)
        for drive in drives:
            drive.doubt = NOT_READ if drive.profile.modbus.identity else ""
            own.register(drive.name, {TAG: OF_A_DRIVE[TAG]}, {TAG: lambda now, drive=drive: _told(drive)})  # type: ignore[misc]

    def moment(self, now: Instant) -> None:
        """The core's present moment, for what comes in."""
        self._now = now

    def drive_up(self, drive: Drive) -> None:
        """A drive answers, for the first time or again: it may be another one."""
        if drive.profile.modbus.identity:
            drive.doubt = NOT_READ
            tags = [drive.tag(term.name) for term in drive.profile.modbus.identity]
            self._read(tags, 0.0, lambda samples: self._seen(drive, samples), self._now)

    def _seen(self, drive: Drive, samples: Sequence[Sample]) -> None:
        if any(sample.quality in AWAY for sample in samples):
            return
        drive.doubt = doubt_about(drive, self._store)
        self._alarms.set(drive.name, ALARM, drive.doubt and f"{drive.name}: {drive.doubt}", self._now)
        self._own.changed([drive.tag(TAG)], self._now)


def _told(drive: Drive) -> str:
    if not drive.profile.modbus.identity:
        return UNVERIFIED
    return drive.doubt or VERIFIED
