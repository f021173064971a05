"""The checks of a resolved profile that go beyond form: do its parts fit each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction

from gateway.mapping import names
from gateway.mapping.commands import STOP
from gateway.mapping.encodings import raw_span, value_span
from gateway.mapping.facts import LOOP_BACK, READ_HOLDING, READ_INPUT, WRITE_MANY, WRITE_ONE
from gateway.mapping.finding import Report
from gateway.mapping.inherit import Inherited
from gateway.mapping.layout import Claim
from gateway.mapping.profile import Kind, Limits, Point, Profile, Table
from gateway.mapping.resolve import Resolved
from gateway.mapping.values import in_words

_COARSEST = 50
"""A range that uses less than one in so many of the raw counts has probably lost its scale."""


def check(resolved: Resolved, stem: str, report: Report) -> None:
    """Complain about everything in a profile that does not fit; ``stem`` is the file's own name."""
    profile = resolved.profile
    if profile.name != stem:
        report.error(
            ("profile",),
            f"the profile `{profile.name}` stands in a file named `{stem}`",
            "make both the same",
        )
    _check_overlap(resolved.layout.claims, report)
    for point in profile.points.values():
        _check_point(point, resolved.layout.keys[point.name], resolved, report)
    _check_names(resolved, report)
    _check_words(resolved, report)
    _check_probe(profile, report)
    _check_commands(profile, report)
    _check_settings(resolved, report)


def _check_overlap(claims: Iterable[Claim], report: Report) -> None:
    """No two entries on the same bits, unless one is only read and the other only written."""
    seen: dict[tuple[Table, int], list[Claim]] = {}
    for claim in claims:
        other = _rival(claim, seen)
        if other is not None:
            register, bit = divmod(max(claim.first, other.first), 16)
            report.error(
                claim.path,
                f"`{claim.name}` and `{other.name}` share bit {bit} of {register:04X}H",
                "correct the address, the bits or the width",
                key=True,
            )
        for bit in range(claim.first, claim.last + 1):
            seen.setdefault((claim.table, bit), []).append(claim)


def _rival(claim: Claim, seen: dict[tuple[Table, int], list[Claim]]) -> Claim | None:
    """Another claim that cannot stand beside this one."""
    for bit in range(claim.first, claim.last + 1):
        for other in seen.get((claim.table, bit), ()):
            if (claim.reads and other.reads) or (claim.writes and other.writes):
                return other
    return None


def _check_point(point: Point, keys: Inherited, resolved: Resolved, report: Report) -> None:
    _check_size(point, keys, resolved.profile, report)
    _check_times(point, keys, resolved, report)
    _check_functions(point, keys, resolved.profile, report)
    _check_origin(point, keys, report)
    if point.limits is not None:
        _check_limits(point, point.limits, keys, resolved, report)
    if (
        point.kind is Kind.SETPOINT
        and point.access.writable
        and point.limits is None
        and not point.encoding.values
    ):
        report.warn(keys.path, f"the setpoint `{point.name}` has no `range`", "add one", key=True)
    if point.kind is Kind.PARAMETER and point.access.writable and point.wear is None:
        report.warn(
            keys.path,
            f"the parameter `{point.name}` does not tell its `wear`",
            "add the number of writes that it lasts, or unknown",
            key=True,
        )


def _check_origin(point: Point, keys: Inherited, report: Report) -> None:
    """What is known of a similar model only, and is written all the same."""
    if point.access.writable and point.provenance.similar:
        message = f"`{point.name}` is written, but known from a similar model only"
        report.warn(keys.path, message, "try it on the drive, and give its own source", key=True)


def _check_size(point: Point, keys: Inherited, profile: Profile, report: Report) -> None:
    modbus = profile.modbus
    for limit, needed in (
        (modbus.read_max, point.access.readable),
        (modbus.write_max, point.access.writable),
    ):
        if needed and point.words > limit:
            report.error(
                keys.place("type"),
                f"`{point.name}` has {point.words} registers, a request at most {limit}",
                "correct the type or the limit",
            )
            return
    for low, high in modbus.holes:
        if point.address <= high and point.address + point.words > low:
            report.error(
                (*keys.path, "at"),
                f"`{point.name}` lies in the hole {low:04X}H to {high:04X}H",
                "correct one of them",
            )


def _check_times(point: Point, keys: Inherited, resolved: Resolved, report: Report) -> None:
    """What multiplies must be a number, and must not need itself."""
    if point.encoding.times is None:
        return
    place = keys.place("times")
    factor = resolved.conditions.target(point.encoding.times, place, key=False)
    if isinstance(factor, Point) and (raw_span(factor.encoding) is None or factor.encoding.values):
        report.error(place, f"`{factor.name}` is no number", "name a setting or point that is")
    if _in_circle(point, resolved.profile):
        report.error(place, f"the scale of `{point.name}` needs itself", "break the circle")


def _in_circle(point: Point, profile: Profile) -> bool:
    seen: set[str] = set()
    name: str | None = point.name
    while name is not None and name not in seen:
        seen.add(name)
        following = profile.points.get(name)
        name = following.encoding.times if following else None
    return name is not None


def _check_functions(point: Point, keys: Inherited, profile: Profile, report: Report) -> None:
    """The drive must speak the functions that its points need."""
    functions = profile.modbus.functions
    needed = READ_INPUT if point.table is Table.INPUT else READ_HOLDING
    if point.access.readable and needed not in functions:
        report.error(
            (*keys.path, "at"),
            f"`{point.name}` cannot be read without function {needed:02X}H",
            "add it to `functions`",
        )
    if not point.access.writable:
        return
    if point.table is Table.INPUT:
        report.error(
            (*keys.path, "at"),
            f"`{point.name}` is an input register and cannot be written",
            "give it a kind that is only read",
        )
    elif not {WRITE_ONE, WRITE_MANY} & set(functions) or (point.words > 1 and WRITE_MANY not in functions):
        report.error(
            (*keys.path, "at"), f"no function of the drive can write `{point.name}`", "add 10H to `functions`"
        )


def _check_limits(point: Point, limits: Limits, keys: Inherited, resolved: Resolved, report: Report) -> None:
    place = keys.place("range")
    for bound in (limits.low, limits.high):
        if isinstance(bound, str):
            _check_bound(bound, point, keys, resolved, report)
    low, high = limits.low, limits.high
    span = value_span(point.encoding)
    if span is None or isinstance(low, str) or isinstance(high, str):
        return
    if low < span[0] or high > span[1]:
        report.warn(
            place,
            f"the range of `{point.name}` goes beyond {in_words(span[0])} to {in_words(span[1])}, "
            "which its counts reach",
            "correct the range or the unit",
        )
    elif point.encoding.symbol is not None and (high - low) * _COARSEST < span[1] - span[0]:
        report.warn(
            place,
            f"the range of `{point.name}` uses less than 1/{_COARSEST} of its counts",
            "see whether the unit is right",
        )


def _check_bound(bound: str, point: Point, keys: Inherited, resolved: Resolved, report: Report) -> None:
    """A limit that is the value of a setting or point must have the same unit."""
    place = keys.place("range")
    target = resolved.conditions.target(bound, place, key=False)
    if target is None:
        return
    symbol = target.encoding.symbol if isinstance(target, Point) else target.symbol
    if symbol != point.encoding.symbol:
        report.error(
            place,
            f"`{bound}` is in {symbol or 'counts'}, `{point.name}` in {point.encoding.symbol or 'counts'}",
            "give both the same unit",
        )


def _check_names(resolved: Resolved, report: Report) -> None:
    for point in resolved.profile.points.values():
        path = resolved.layout.keys[point.name].path
        meaning = names.misused(point)
        if meaning:
            report.warn(
                path, f"`{point.name}` is a shared name and means {meaning}", "use another name", key=True
            )
        _check_near(point.name, path, list(names.STANDARD), report)
    for command in resolved.profile.commands:
        _check_near(command, ("commands", command), list(names.COMMANDS), report)


def _check_near(name: str, path: tuple[str | int, ...], standard: list[str], report: Report) -> None:
    known = names.near_miss(name, standard)
    if known:
        report.warn(
            path,
            f"`{name}` looks like the shared name `{known}`",
            f"if it means that, name it `{known}`",
            key=True,
        )


def _check_words(resolved: Resolved, report: Report) -> None:
    """A field can be written only if the rest of its register is known: by image or by reading."""
    points = resolved.profile.points
    for word in resolved.profile.words.values():
        fields = [points[name] for name in word.fields]
        written = [point for point in fields if point.access.writable]
        whole = any(point.access.readable for point in fields)
        if written and not word.image and not whole:
            path = resolved.layout.keys[written[0].name].path
            report.error(
                path[:-2],
                f"`{written[0].name}` is written, but the rest of {word.address:04X}H is "
                "neither read nor kept",
                "add `image: true`",
                key=True,
            )


def _check_probe(profile: Profile, report: Report) -> None:
    probe = profile.modbus.probe
    place = ("modbus", "probe")
    if probe == "loop_back":
        if LOOP_BACK not in profile.modbus.functions:
            report.error(place, "`loop_back` needs function 08H", "add it to `functions`, or name a point")
    elif not probe:
        report.unknown_name(
            ("groups",), "no point can be read, so the drive can never be seen", "add one", key=True
        )
    elif probe not in profile.points:
        report.unknown_name(place, f"`{probe}` is no point", "name a point, or loop_back")
    elif not profile.points[probe].access.readable:
        report.error(place, f"`{probe}` cannot be read", "name a point that can")


def _check_commands(profile: Profile, report: Report) -> None:
    runs = [name for name in profile.commands if name.startswith("run_")]
    if runs and STOP not in profile.commands:
        message = f"there is `{runs[0]}`, but no command `stop`"
        report.unknown_name(("commands", runs[0]), message, "add it", key=True)
    stop = profile.commands.get(STOP)
    if stop is not None and (stop.args or stop.only_when):
        key = "args" if stop.args else "only_when"
        report.error(("commands", STOP, key), "`stop` waits for nothing", f"leave `{key}` out", key=True)


def _check_settings(resolved: Resolved, report: Report) -> None:
    profile = resolved.profile
    used = resolved.conditions.used | set(_needed(profile))
    action = profile.serial.comm_loss.action
    if action is not None:
        resolved.conditions.target(action, ("serial", "comm_loss", "action"), key=False)
        used.add(action)
    for name in profile.settings:
        if name not in used and not report.partial:
            report.warn(("settings", name), f"nothing uses the setting `{name}`", "leave it out", key=True)


def _needed(profile: Profile) -> Iterator[str]:
    """Names that limits and scales of the points refer to."""
    for point in profile.points.values():
        bounds: tuple[Fraction | str | None, ...] = (point.encoding.times,)
        if point.limits:
            bounds += (point.limits.low, point.limits.high)
        yield from (bound for bound in bounds if isinstance(bound, str))
