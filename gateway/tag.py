"""The vocabulary that every part shares: tags, samples, outcomes, roles, instants.

Imports nothing of ours. The structs here are frozen and travel unchanged over the bridge socket.

A *tag* is a point of one drive and is written ``<drive>.<point>``, as in ``fan-1.output_frequency``.
Names that begin with an underscore are the gateway's own, and no drive, line or point of a profile has such a
name: ``fan-1._timeouts``, ``_north.utilisation`` for the line ``north``, ``_gateway.uptime``.
Times named ``time`` are wall-clock nanoseconds since 1970 (UTC); times named ``mono`` are seconds of
the monotonic clock and mean nothing outside the process that took them.
"""

from __future__ import annotations

from enum import StrEnum
from fnmatch import fnmatchcase
from itertools import zip_longest
from typing import NamedTuple

import msgspec

Value = bool | int | float | str | None
"""What a point can hold: a bit, a count or enumeration number, an engineering value, a text, nothing."""


class Instant(NamedTuple):
    """One moment on both clocks: intervals are taken from ``mono``, time stamps from ``wall``."""

    mono: float
    wall: int


class ValueType(StrEnum):
    """The type of a point's value as clients see it; it never changes while the gateway runs."""

    BOOLEAN = "boolean"
    INTEGER = "integer"
    NUMBER = "number"
    TEXT = "text"


class Severity(StrEnum):
    """The three classes of quality that every protocol knows."""

    GOOD = "good"
    UNCERTAIN = "uncertain"
    BAD = "bad"


class Quality(StrEnum):
    """How far a sample may be believed, and if not, why."""

    GOOD = "good"
    STALE = "stale"
    """The last value read; older than two of its promised periods."""
    WAITING = "waiting"
    """No value has been read yet."""
    NO_COMMUNICATION = "no_communication"
    """The drive does not answer."""
    LINE_DOWN = "line_down"
    """The serial port is closed, unplugged or refused."""
    REFUSED = "refused"
    """The drive answers that it does not have the register or will not give it."""
    INVALID = "invalid"
    """The raw value is a sentinel for "no value", or cannot be decoded."""
    NOT_APPLICABLE = "not_applicable"
    """The point does not exist in the drive's present mode, or holds a name in place of a number
    (``switched_off``)."""
    CONFIGURATION = "configuration"
    """The mapping and the drive contradict each other."""

    @property
    def severity(self) -> Severity:
        """Good, uncertain or bad."""
        if self is Quality.GOOD:
            return Severity.GOOD
        return Severity.UNCERTAIN if self is Quality.STALE else Severity.BAD


class Sample(msgspec.Struct, frozen=True, gc=False, array_like=True):
    """A value with what is known about it.

    ``time`` is when the frame that carried the value was complete, or, for a bad quality, when that
    quality was established. ``age`` is the promise: the worst-case age in seconds that the plan holds
    for this tag (0 when nothing is promised). ``text`` is the name of an enumeration value. A bad
    sample has the value None and its ``reason`` says why in words.
    """

    tag: str
    value: Value
    quality: Quality
    time: int
    age: float = 0.0
    text: str | None = None
    reason: str = ""


class Verdict(StrEnum):
    """Progress (the first three) and final state of a write or command. One vocabulary everywhere."""

    ACCEPTED = "accepted"
    SENT = "sent"
    ANSWERED = "answered"
    CONFIRMED = "confirmed"
    """Read back (or proved by the command's own condition)."""
    REFUSED = "refused"
    """By a rule of ours or by the drive; nothing was changed."""
    FAILED = "failed"
    """Answered, but the drive shows that it did not take effect, or the line is down."""
    UNKNOWN = "unknown"
    """Sent, and nothing tells whether it was done."""
    EXPIRED = "expired"
    """Its time to live ended before it was sent."""
    SUPERSEDED = "superseded"
    """A newer write to the same setpoint took its place before it was sent, or a stop did before it
    was proved."""

    @property
    def final(self) -> bool:
        """True when nothing more will be said about the write."""
        return self not in (Verdict.ACCEPTED, Verdict.SENT, Verdict.ANSWERED)


class Cause(StrEnum):
    """Why an outcome is not ``confirmed``, for programs; the words for people stand in ``reason``."""

    NONE = ""
    WRITES_DISABLED = "writes_disabled"
    UNKNOWN_TAG = "unknown_tag"
    UNKNOWN_COMMAND = "unknown_command"
    UNKNOWN_ALARM = "unknown_alarm"
    NOT_WRITABLE = "not_writable"
    WRONG_TYPE = "wrong_type"
    WRONG_ARGUMENTS = "wrong_arguments"
    OUT_OF_RANGE = "out_of_range"
    NO_RIGHTS = "no_rights"
    PRECONDITION = "precondition"
    DANGER = "danger"
    LEASE = "lease"
    """Somebody else holds the lease of the drive, or it must be acquired first."""
    MAINTENANCE = "maintenance"
    """The drive is in maintenance: only a stop is let through."""
    STEP = "step"
    """The value differs more from the present one than one write may change."""
    TOO_SOON = "too_soon"
    """Its turn comes after its time to live: the point, or a drive of the same group, was written before."""
    RETAINED = "retained"
    EXPIRED = "expired"
    WRONG_EPOCH = "wrong_epoch"
    MALFORMED = "malformed"
    DUPLICATE = "duplicate"
    OVERFLOW = "overflow"
    JOURNAL = "journal"
    WEAR = "wear"
    """One more write today would wear the drive's memory more than the site allows."""
    DRIVE_REFUSED = "drive_refused"
    """The drive answered with an error code; ``code`` holds it."""
    NO_ANSWER = "no_answer"
    LINE_DOWN = "line_down"
    NOT_PROVED = "not_proved"
    """The drive answered, but what it shows afterwards is not what was asked."""
    SUPERSEDED = "superseded"
    SHUTTING_DOWN = "shutting_down"
    INTERNAL = "internal"
    """A fault of the gateway itself."""


class Outcome(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What became of one write or command, in the words of every protocol.

    ``code`` is the drive's own error code and ``drive_error`` its name in the profile (``locked``), if
    the drive refused. ``value`` is what the drive showed on read-back, never an echo of the request.
    ``asked``, ``sent`` and ``done`` are wall-clock nanoseconds, 0 when that moment never came.
    """

    verdict: Verdict
    cause: Cause = Cause.NONE
    reason: str = ""
    code: int | None = None
    drive_error: str | None = None
    value: Value = None
    asked: int = 0
    sent: int = 0
    done: int = 0


class Role(StrEnum):
    """What a person or program may do; each role may do what the ones before it may."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ENGINEER = "engineer"
    ADMIN = "admin"

    def covers(self, needed: Role) -> bool:
        """True when this role includes the rights of ``needed``."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class Origin(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Who asks for a write: for the guard, the leases and the journal.

    ``through`` is the way in (``opcua``, ``mqtt``, ``cli``); ``session`` identifies one client within
    it; ``authenticated`` is False where the protocol cannot tell who the sender is (MQTT).
    """

    through: str
    who: str
    role: Role
    session: str = ""
    address: str = ""
    authenticated: bool = True
    together: int = 1
    """How many writes came in the same request."""


class Event(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something worth telling: a drive lost or back, a fault coming or going, an alarm.

    ``drive`` is what it is about: a drive; for an alarm also a line, or the gateway itself.
    """

    time: int
    drive: str
    name: str
    """``communication_lost``, ``communication_restored``, ``fault_raised``, ``fault_cleared``, ``line_down``,
    ``line_up``, ``gap_refused``, ``register_refused``, ``alarm_raised``, ``alarm_cleared``,
    ``alarm_acknowledged``."""
    text: str
    tag: str = ""
    value: Value = None
    alarm: str = ""
    """What the alarm is acknowledged by."""


def tag_of(drive: str, point: str) -> str:
    """The tag of a drive's point."""
    return f"{drive}.{point}"


def split_tag(tag: str) -> tuple[str, str]:
    """Drive and point of a tag; the point is empty when there is no dot in ``tag``."""
    drive, _, point = tag.partition(".")
    return drive, point


OWN = "_"
"""What the gateway's own names begin with."""
GATEWAY = f"{OWN}gateway"
"""What the gateway itself is called in tags."""


def own_name(name: str) -> str:
    """What a line, or a point that the gateway adds to a drive, is called in tags: ``_north``."""
    return f"{OWN}{name}"


def is_own(tag: str) -> bool:
    """True for what the gateway tells of itself, a line or its dealings with a drive."""
    return any(part.startswith(OWN) for part in split_tag(tag))


def matches(pattern: str, name: str) -> bool:
    """True when a pattern with ``*`` and ``?`` means a name, which may be a tag.

    As in a shell, nothing stands for what is hidden: a pattern means one of the gateway's own names only if
    it has the underscore itself. ``fan-1.*`` means all points of the profile, ``fan-1._*`` the others.
    """
    parts = zip_longest(name.split("."), pattern.split("."), fillvalue="")
    return fnmatchcase(name, pattern) and all(
        asked.startswith(OWN) or not part.startswith(OWN) for part, asked in parts
    )


def means(pattern: str, tag: str) -> bool:
    """True when a publish rule's pattern means a tag: a whole tag if it has a dot, else points of drives."""
    owner, point = split_tag(tag)
    return matches(pattern, tag) if "." in pattern else matches(pattern, point) and not owner.startswith(OWN)
