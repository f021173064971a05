"""The checks that every write passes before a byte of it is made. Pure.

Whatever way a write came in, it is checked here on arrival; what depends on the drive's state is
checked again by the procedure and once more when the frame is about to go. The limits are those of
profile and site, never the client's. Ids such as T2 refer to the hazard list in ``docs/safety.md``.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

from gateway.core.drive import Drive
from gateway.core.meaning import Meaning, is_fixed, meaning_of
from gateway.core.store import Store
from gateway.mapping.absent import why_absent
from gateway.mapping.encodings import raw_span
from gateway.mapping.profile import Command, Constant, Encoding, Kind, Limits, Point
from gateway.modbus.encoding import EncodingError, decode, encode, insert, to_words
from gateway.tag import OWN, Cause, Origin, Outcome, Role, Value, ValueType, Verdict

INVALID = "invalid"
"""The name of raw values that are never written: the reading is bad."""
MESSAGE_LIMIT = 10**300
RUN = "run"
RUNNING = "running"


class Ended(Exception):  # noqa: N818 - it ends a procedure; it is no programming error
    """A write or command ends here, with this outcome."""

    def __init__(
        self,
        verdict: Verdict,
        cause: Cause,
        reason: str,
        code: int | None = None,
        drive_error: str | None = None,
    ) -> None:
        super().__init__(reason)
        self.outcome = Outcome(
            verdict=verdict, cause=cause, reason=reason, code=code, drive_error=drive_error
        )


def refuse(cause: Cause, reason: str) -> Ended:
    """A refusal by a rule of ours."""
    return Ended(Verdict.REFUSED, cause, reason)


@dataclass(frozen=True, slots=True)
class Consent:
    """What stands for a value that does harm: the role of who asks, the words with which he confirms that he
    knows what happens, and how many writes came in the same request."""

    role: Role = Role.VIEWER
    confirm: str = ""
    together: int = 1


NO_CONSENT = Consent()


def check_rights(needed: Role | None, origin: Origin, ceiling: Role) -> Role:
    """E1: the role must cover what is asked, and no client may claim more than its way in allows. The role
    that counts.

    Raises:
        Ended: if it does not.
    """
    role = origin.role if ceiling.covers(origin.role) else ceiling
    if needed is None or not role.covers(needed):
        raise refuse(
            Cause.NO_RIGHTS, f"{role.value} may not do this; it takes {needed.value if needed else 'more'}"
        )
    return role


def check_point(drive: Drive, name: str) -> Point:
    """T1: only a mapped, writable point may be written.

    Raises:
        Ended: if there is no such point, or it takes no single writes.
    """
    point = drive.profile.points.get(name)
    if name.startswith(OWN):
        raise refuse(Cause.NOT_WRITABLE, f"{name} is told by the gateway; nobody writes it")
    if point is None:
        why = _because(drive, name) or _nearest(name, drive.profile.points)
        raise refuse(Cause.UNKNOWN_TAG, f"{drive.name} has no point {name}{why}")
    if point.by_command_only:
        names = ", ".join(
            c.name for c in drive.profile.commands.values() if any(name in s.write for s in c.steps)
        )
        raise refuse(Cause.NOT_WRITABLE, f"{name} is written by commands only: {names or 'none does'}")
    if not point.access.writable:
        raise refuse(Cause.NOT_WRITABLE, f"{name} is read-only")
    return point


def check_command(drive: Drive, name: str) -> Command:
    """The command of that name.

    Raises:
        Ended: if there is none.
    """
    command = drive.profile.commands.get(name)
    if command is None:
        commands = drive.profile.commands
        why = (
            _because(drive, name) or _nearest(name, commands) or f" (it has {', '.join(commands) or 'none'})"
        )
        raise refuse(Cause.UNKNOWN_COMMAND, f"{drive.name} has no command {name}{why}")
    return command


def check_arguments(
    drive: Drive, store: Store, command: Command, args: Mapping[str, Value], consent: Consent
) -> dict[str, Fraction]:
    """The exact numbers of a command's arguments, checked as far as that needs no look at the drive.

    Raises:
        Ended: if one is missing, unknown or wrong, or the command does harm.
    """
    name = command.name
    if command.urgent and not command.args:
        args = {}  # whoever wants a stop gets it, whatever else he says
    if set(args) != set(command.args):
        wanted = ", ".join(command.args) or "no arguments"
        raise refuse(Cause.WRONG_ARGUMENTS, f"{name} takes {wanted}; given: {', '.join(args) or 'none'}")
    numbers = {}
    for argument, point_name in command.args.items():
        point = drive.profile.points[point_name]
        numbers[argument] = check_value(drive, store, point, args[argument], argument, consent)
    for point, raw in fixed_values(drive, command):
        check_danger(point, raw, name, consent)
    return numbers


def _because(drive: Drive, name: str) -> str:
    """Why the drive has not what its profile knows, to be put behind a sentence."""
    reason = why_absent(drive.config, name)
    return f": {reason}" if reason else ""


def _nearest(name: str, known: Iterable[str]) -> str:
    """What may have been meant, to be put behind a sentence."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f" (did you mean {close[0]}?)" if close else ""


def fixed_values(drive: Drive, command: Command) -> Iterator[tuple[Point, int]]:
    """The points that a command always writes the same values to, and their raw values."""
    for step in command.steps:
        for name, value in step.write.items():
            if isinstance(value, Constant):
                point = drive.profile.points[name]
                yield point, encode(point.encoding, value.value)


def check_value(
    drive: Drive, store: Store, point: Point, value: Value, name: str, consent: Consent
) -> Fraction:
    """The exact number of a client's value, checked as far as that needs no look at the drive.

    Raises:
        Ended: if it is of the wrong type or out of range.
    """
    if (raw := special_raw(point, value)) is not None:
        check_danger(point, raw, name, consent)
        return Fraction(raw)
    number = engineering(point.encoding, name, value)
    if is_fixed(drive, point):
        meaning = meaning_of(drive, store, replace(point, when=()))
        if isinstance(meaning, Meaning):
            check_danger(point, raw_value(drive, point, meaning, number, name), name, consent)
    return number


def special_raw(point: Point, value: Value) -> int | None:
    """The raw value of what is no number and has a name (``switched_off``); None for anything else, and for
    what only says that a reading is invalid."""
    named = {name: raw for raw, name in point.encoding.special.items() if name != INVALID}
    raw = named.get(value) if isinstance(value, str) else None
    span = raw_span(point.encoding)
    if raw is None or span is None:
        return None
    return raw if raw <= span[1] else raw - (span[1] - span[0] + 1)  # given as bits


def check_danger(point: Point, raw: int, name: str, consent: Consent) -> None:
    """A value that does harm takes an admin who says that he knows what happens, and a request of its own.

    Raises:
        Ended: if anything of that is missing.
    """
    harm = point.danger.get(raw)
    if harm is None:
        return
    if not consent.role.covers(Role.ADMIN):
        raise refuse(Cause.DANGER, f"{name}: {harm}; only an admin may do that")
    if consent.together > 1:
        raise refuse(Cause.DANGER, f"{name}: {harm}; that takes a request of its own")
    if consent.confirm.strip().casefold() != harm.casefold():
        raise refuse(Cause.DANGER, f"{name}: {harm}; to do it, confirm with just these words: {harm}")


def engineering(encoding: Encoding, name: str, value: Value) -> Fraction:
    """T2: the exact number that a client's value stands for; bits as 0 and 1, enumerations by number.

    Raises:
        Ended: if the value is of the wrong type, not finite, or not among the names.
    """
    kind = encoding.value_type
    if kind is ValueType.TEXT:
        raise refuse(Cause.WRONG_TYPE, f"{name} is a text; texts cannot be written yet")
    if encoding.values:
        return Fraction(_enumerated(encoding, name, value))
    if kind is ValueType.BOOLEAN:
        if not isinstance(value, bool):
            raise refuse(Cause.WRONG_TYPE, f"{name} takes true or false, not {value!r}")
        return Fraction(int(value))
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise refuse(Cause.WRONG_TYPE, f"{name} takes a number, not {value!r}")
    if isinstance(value, float) and not math.isfinite(value):
        raise refuse(Cause.OUT_OF_RANGE, f"{name} takes a finite number, not {value}")
    if kind is ValueType.INTEGER and value != int(value):
        raise refuse(Cause.WRONG_TYPE, f"{name} takes a whole number, not {value}")
    return Fraction(value) if isinstance(value, int) else Fraction(str(value))


def _enumerated(encoding: Encoding, name: str, value: Value) -> int:
    """An enumeration's raw number, given by name or by number."""
    for raw, text in encoding.values.items():
        if value == text or (
            isinstance(value, (int, float)) and not isinstance(value, bool) and value == raw
        ):
            return raw
    if isinstance(value, bool) or value is None:
        raise refuse(Cause.WRONG_TYPE, f"{name} takes a name or a number, not {value!r}")
    names = ", ".join(encoding.values.values())
    raise refuse(Cause.OUT_OF_RANGE, f"{name} has no value {value!r} (it has {names})")


def raw_value(
    drive: Drive, point: Point, meaning: Meaning, number: Fraction, name: str, negated: bool = False
) -> int:
    """T2: the raw value of a number, after the range was checked in the unit and again in raw counts.

    ``negated``: the profile turns the caller's sign, so the limits hold for the number before that.

    Raises:
        Ended: if it is out of range or does not fit the register.
    """
    sign = -1 if negated else 1
    check_range(drive, point, meaning.limits, sign * number, name)
    encoding = meaning.encoding
    try:
        raw = encode(encoding, number, meaning.times)
    except EncodingError as error:
        raise refuse(Cause.OUT_OF_RANGE, f"{name}: {error}") from error
    words = (insert(encoding, raw, 0),) if encoding.width else to_words(encoding, raw)
    rounded = decode(encoding, words, meaning.times).value
    if not encoding.values and isinstance(rounded, (int, float)) and not isinstance(rounded, bool):
        check_range(drive, point, meaning.limits, sign * Fraction(str(rounded)), f"{name} after rounding")
    return raw


def check_range(drive: Drive, point: Point, limits: Limits | None, number: Fraction, name: str) -> None:
    """The number must lie within the profile's limits, narrowed by the site.

    Raises:
        Ended: if it does not.
    """
    span = drive.limits(point, limits)
    if span is not None and not span[0] <= number <= span[1]:
        unit = point.encoding.symbol or ""
        text = f"{float(span[0]):g}..{float(span[1]):g} {unit}".rstrip()
        raise refuse(Cause.OUT_OF_RANGE, f"{name} = {_shown(number)} is outside {text}")


def _shown(number: Fraction) -> str:
    """A number for a message; it may be far beyond what a float can hold."""
    return f"{float(number):g}" if abs(number) < MESSAGE_LIMIT else "a number beyond all bounds"


def starts_motor(command: Command) -> bool:
    """True for a command that sets the motor running: by its name, or by what proves it."""
    if command.name == RUN or command.name.startswith(f"{RUN}_"):
        return True
    terms = [term for step in command.steps for term in step.until if term.name == RUNNING]
    return any(low <= 1 <= high for term in terms for low, high in term.ranges)


def is_setpoint(point: Point) -> bool:
    """True for points whose newest write takes the place of older ones that still wait."""
    return point.kind is Kind.SETPOINT
