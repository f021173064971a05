"""The checks of a resolved profile that go beyond form: do its parts fit each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction

from gateway.mapping import names
from gateway.mapping.broadcastcheck import check_sets
from gateway.mapping.circles import check_circles
from gateway.mapping.commands import STOP, STOP_ALL
from gateway.mapping.coverage import check_cases
from gateway.mapping.facts import FUNCTIONS, LOOP_BACK
from gateway.mapping.finding import Report, some
from gateway.mapping.layout import Layout
from gateway.mapping.node import Path
from gateway.mapping.overlap import check_overlap
from gateway.mapping.pointcheck import check_point
from gateway.mapping.profile import Point, Profile
from gateway.mapping.reachcheck import check_holes, check_reach
from gateway.mapping.resolve import Resolved
from gateway.mapping.shape import nearest


def check(resolved: Resolved, stem: str, report: Report) -> None:
    """Complain about everything in a profile that does not fit; ``stem`` is the file's own name."""
    profile = resolved.profile
    if profile.name != stem:
        message = f"the profile `{profile.name}` stands in a file named `{stem}`"
        report.error(("profile",), message, "make both the same")
    layout = resolved.layout
    check_overlap(layout, profile.points, report)
    check_reach(profile.points.values(), layout, profile.modbus, report)
    check_holes(profile.points.values(), layout, profile.modbus, report)
    for point in _first_of_each_entry(layout, profile.points):
        check_point(point, layout, resolved, report)
        if point.cases and not report.wrong(layout.keys[point.name].place("cases")):
            check_cases(point, layout.keys[point.name], profile, report)
    check_circles(profile.points, resolved.layout.keys, report)
    _check_origins(profile, report)
    _check_names(resolved, report)
    _check_words(resolved, report)
    _check_probe(profile, report)
    _check_commands(profile, report)
    _check_settings(resolved, report)
    _check_followers(resolved, report)
    _check_broadcast(resolved, report)
    check_sets(resolved, report)
    _check_identity(profile, report)


def _first_of_each_entry(layout: Layout, points: Mapping[str, Point]) -> Iterable[Point]:
    """The points without the repeats of one entry, which are as right or wrong as the first."""
    first: dict[Path, Point] = {}
    for point in points.values():
        first.setdefault(layout.keys[point.name].path, point)
    return first.values()


def _check_origins(profile: Profile, report: Report) -> None:
    """What is known of similar models only, and is written all the same: told once for the whole profile."""
    points = [p.name for p in profile.points.values() if p.access.writable and p.provenance.similar]
    if points and not report.wrong_key("source"):
        message = f"{some(points)}: written, but known from similar models only"
        report.warn(("documents",), message, "try it on the drive, and give its own source", key=True)


def _check_broadcast(resolved: Resolved, report: Report) -> None:
    """The layout for all drives at once is checked as their own is; what starts them all must stop them."""
    broadcast, layout = resolved.profile.broadcast, resolved.broadcast
    if broadcast is None:
        return
    check_overlap(layout, broadcast.points, report)
    check_reach(broadcast.points.values(), layout, resolved.profile.modbus, report)
    for point in _first_of_each_entry(layout, broadcast.points):
        check_point(point, layout, resolved, report)
    runs = [name for name in broadcast.commands if name.startswith("run_")]
    if runs and STOP_ALL not in broadcast.commands:
        place = ("broadcast", "commands", runs[0])
        message = f"there is `{runs[0]}`, but no command `{STOP_ALL}`"
        report.unknown_name(place, STOP_ALL, message, "add it", key=True)


def _check_followers(resolved: Resolved, report: Report) -> None:
    """`then` names a command that writes no parameter itself, `twin` a point, `shift` a setting."""
    profile = resolved.profile
    for point in profile.points.values():
        keys = resolved.layout.keys[point.name]
        if point.then is not None:
            _check_then(point, profile, keys.place("then"), report)
        if point.twin is not None and point.twin not in resolved.layout.doubtful:
            _check_twin(point, profile, (*keys.path, "twin"), report)
        if point.shift is not None and point.shift not in profile.settings:
            remedy = nearest(point.shift, list(profile.settings))
            report.unknown_name(keys.place("shift"), point.shift, f"`{point.shift}` is no setting", remedy)


def _check_twin(point: Point, profile: Profile, place: Path, report: Report) -> None:
    """A twin takes the same values and does not wear."""
    twin = profile.points.get(point.twin or "")
    if twin is None:
        remedy = nearest(point.twin or "", list(profile.points))
        report.unknown_name(place, point.twin or "", f"`{point.twin}` is no point", remedy)
    elif not twin.access.writable or twin.encoding.symbol != point.encoding.symbol:
        message = f"`{twin.name}` does not take what `{point.name}` takes"
        report.error(place, message, "name a point that is written in the same unit")
    elif twin.wear is not None:
        report.error(place, f"`{twin.name}` wears too, so it spares nothing", "name a point without `wear`")


def _check_then(point: Point, profile: Profile, place: Path, report: Report) -> None:
    command = profile.commands.get(point.then or "")
    if command is None:
        remedy = nearest(point.then or "", list(profile.commands))
        report.unknown_name(place, point.then or "", f"`{point.then}` is no command", remedy)
    elif command.args or any(profile.points[name].then for step in command.steps for name in step.write):
        message = f"`{point.then}` cannot follow a write: it takes arguments, or starts itself again"
        report.error(place, message, "name a command that only stores or activates")


def _check_names(resolved: Resolved, report: Report) -> None:
    for point in resolved.profile.points.values():
        path = resolved.layout.keys[point.name].path
        meaning = names.misused(point)
        if meaning and point.name not in resolved.layout.doubtful:
            report.warn(
                path, f"`{point.name}` is a shared name and means {meaning}", "use another name", key=True
            )
        _check_near(point.name, path, list(names.STANDARD), report)
    for command in resolved.profile.commands:
        _check_near(command, ("commands", command), list(names.COMMANDS), report)


def _check_near(name: str, path: tuple[str | int, ...], standard: list[str], report: Report) -> None:
    known = names.near_miss(name, standard)
    if known and not report.missing(known):
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
        path = resolved.layout.keys[written[0].name].path[:-2] if written else ()
        if written and not word.image and not whole and not report.wrong(path):
            rest = f"the rest of {word.address:04X}H is neither read nor kept"
            message = f"`{written[0].name}` is written, but {rest}"
            report.error(path, message, "add `image: true`", key=True)


def _check_probe(profile: Profile, report: Report) -> None:
    probe = profile.modbus.probe
    place = ("modbus", "probe")
    if probe == "loop_back":
        if LOOP_BACK not in profile.modbus.functions and not report.wrong(FUNCTIONS):
            report.error(place, "`loop_back` needs function 08H", "add it to `functions`, or name a point")
    elif not probe:
        if not report.wrong(("groups",)):
            report.error(
                ("groups",), "no point can be read, so the drive can never be seen", "add one", key=True
            )
    elif probe not in profile.points:
        report.unknown_name(place, probe, f"`{probe}` is no point", "name a point, or loop_back")
    elif not profile.points[probe].access.readable:
        report.error(place, f"`{probe}` cannot be read", "name a point that can")


def _check_identity(profile: Profile, report: Report) -> None:
    """What a drive is recognised by comes from the drive, and stays what it is."""
    for term in profile.modbus.identity:
        place = ("modbus", "identity", term.name)
        point = profile.points.get(term.name)
        if term.setting:
            report.error(place, f"`{term.name}` is a setting, which no drive shows", "name a point", key=True)
        elif point is not None and point.access.writable and not point.danger:
            message = f"`{term.name}` is written, so it proves nothing"
            report.warn(place, message, "name a point that nobody changes", key=True)


def _check_commands(profile: Profile, report: Report) -> None:
    runs = [name for name in profile.commands if name.startswith("run_")]
    if runs and STOP not in profile.commands:
        message = f"there is `{runs[0]}`, but no command `stop`"
        report.unknown_name(("commands", runs[0]), STOP, message, "add it", key=True)
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
        if name not in used and not report.lost.use(name) and not report.meant(name):
            report.warn(("settings", name), f"nothing uses the setting `{name}`", "leave it out", key=True)


def _needed(profile: Profile) -> Iterator[str]:
    """Names that limits and scales of the points refer to."""
    for point in profile.points.values():
        uses = [(point.encoding, point.limits), *((case.encoding, case.limits) for case in point.cases)]
        for encoding, limits in uses:
            bounds: tuple[Fraction | str | None, ...] = (encoding.times, point.shift)
            if limits:
                bounds += (limits.low, limits.high)
            yield from (bound for bound in bounds if isinstance(bound, str))
