"""A profile as a sheet that people read: nameplate, facts, points, commands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from rich.table import Table

from gateway.mapping.profile import (
    OURS,
    Case,
    Command,
    CommLoss,
    Condition,
    Document,
    ErrorMeaning,
    Limits,
    ModbusFacts,
    Notation,
    Point,
    Profile,
    Provenance,
    SerialFacts,
    Setting,
    Step,
)
from gateway.mapping.profile import (
    Table as Registers,
)
from gateway.terminal.facts import error_object, modbus_object, serial_object, setting_object
from gateway.terminal.points import in_words, range_object
from gateway.terminal.profiles import written

COLUMNS = ("point", "register", "type", "unit", "range", "access", "rate", "notes")
SIMILAR = "similar model, unverified"
NOBODYS = "in no document"


def head(profile: Profile) -> Iterator[str]:
    """Nameplate, documents, facts, settings and errors, a line each."""
    yield f"{profile.name}: {profile.title} ({profile.maker} {', '.join(profile.models)})"
    for key, document in profile.documents.items():
        yield f"  {key}: {document.title}" + (f" ({SIMILAR})" if document.similar else "")
    yield from (_notation_line(notation) for notation in profile.notations)
    yield _fact("serial", serial_object(profile.serial) | _spans(profile.serial))
    yield _fact("modbus", modbus_object(profile.modbus) | {"holes": _holes(profile.modbus)})
    for key, provenance in profile.facts.items():
        yield f"  {key}: {'; '.join(text for text in (origin_text(provenance), provenance.doubt) if text)}"
    yield from (_setting_line(setting) for setting in profile.settings.values())
    yield from (_error_line(code, error) for code, error in profile.errors.items())


def points_table(points: Iterable[Point]) -> Table:
    """The points, one a row."""
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0))
    for title in COLUMNS:
        table.add_column(title)
    for point in points:
        table.add_row(*_row(point))
    return table


def command_lines(commands: Mapping[str, Command], points: Mapping[str, Point]) -> Iterator[str]:
    """The commands with their steps, a line each."""
    for command in commands.values():
        first, *rest = command_text(command, points)
        yield f"command {first}"
        yield from (f"  {line}" for line in rest)


def command_text(command: Command, points: Mapping[str, Point]) -> Iterator[str]:
    """A command with its arguments and condition, then its steps, a line each."""
    args = " ".join(f"{arg}=({point})" for arg, point in command.args.items())
    yield f"{command.name} {args}".rstrip() + _only_when(command.only_when)
    yield from (_step_text(step, points) for step in command.steps)


def source_text(provenance: Provenance, documents: Mapping[str, Document]) -> str:
    """Where something stands: ``SI-M interface card, communication manual: 9.2 (sim)``."""
    if provenance.document == OURS:
        return NOBODYS
    document = documents.get(provenance.document)
    title = document.title if document else "none"
    return f"{title}: {provenance.place} ({provenance.document})"


def origin_text(provenance: Provenance) -> str:
    """Document and place in a few words: ``sim 9.2``, ``sc3 p.129 (similar model, unverified)``."""
    if provenance.document == OURS:
        return NOBODYS
    similar = f" ({SIMILAR})" if provenance.similar else ""
    return f"{provenance.document} {provenance.place}".strip() + similar


def doubt_text(provenance: Provenance) -> str:
    """Why something may be wrong; empty where nothing speaks against it."""
    similar = f"{SIMILAR} ({provenance.document} {provenance.place})" if provenance.similar else ""
    return "; ".join(text for text in (similar, provenance.doubt or "") if text)


def place_text(point: Point) -> str:
    """Where a point is: ``Sn-08 0107H.2-3``."""
    wire = f"{point.address:04X}H"
    cut = point.encoding
    bits = f".{cut.bit:X}" + (f"-{cut.bit + cut.width - 1:X}" if cut.width > 1 else "") if cut.width else ""
    return f"{wire}{bits}" if point.notation in ("", wire) else f"{point.notation} {wire}{bits}"


def notes(point: Point, doubts: bool = True) -> Iterator[str]:
    """What else there is to know of a point, each in a few words."""
    if point.shift is not None:
        yield f"address + {point.shift}"
    yield from (f"when {term.text}" for term in point.when)
    yield from (_case_text(case) for case in point.cases)
    yield from (f"{raw}={name}" for raw, name in {**point.encoding.values, **point.encoding.special}.items())
    yield from (f"select {name}={value.value}" for name, value in point.select.items())
    yield from (f"written only when {term.text}" for term in point.only_when)
    yield from (text for text, holds in _writing_notes(point) if holds)
    yield from sorted(set(point.danger.values()))
    if doubts and (doubt := doubt_text(point.provenance)):
        yield doubt


def _writing_notes(point: Point) -> Iterator[tuple[str, bool]]:
    yield f"pulse {point.pulse:g} s", point.pulse > 0
    yield f"then {point.then}", point.then is not None
    yield f"wears out ({point.wear}); without wear: {point.twin}", point.twin is not None
    yield f"wear {point.wear}", point.wear is not None and point.twin is None
    yield f"step {point.pace.step}", point.pace.step is not None
    yield f"slew {point.pace.slew}/s", point.pace.slew is not None
    yield f"every {point.pace.interval:g} s", point.pace.interval > 0
    yield "the drive does not answer", point.silent
    yield f"pause {point.pause:g} s", point.pause > 0


def _row(point: Point) -> tuple[str, ...]:
    encoding = point.encoding
    symbol = encoding.symbol or ""
    unit = symbol if point.cases else f"{encoding.scale} {symbol}" if symbol else ""
    texts = "; ".join([*([point.help] if point.help else []), *notes(point)])
    return (
        point.name,
        place_text(point),
        encoding.type,
        unit,
        _range(point.limits),
        point.access,
        point.rate,
        texts,
    )


def _case_text(case: Case) -> str:
    encoding = case.encoding
    times = f" x {encoding.times}" if encoding.times else ""
    when = _listed(case.when) or "otherwise"
    return f"{when}: {encoding.scale} {encoding.symbol or ''}{times}".rstrip()


def _range(limits: Limits | None) -> str:
    ends = range_object(limits)
    return "" if ends is None else f"{ends[0]}..{ends[1]}"


def _fact(name: str, facts: Mapping[str, object]) -> str:
    return f"{name}: " + ", ".join(f"{key} {_plain(value)}" for key, value in facts.items() if value != [])


def _plain(value: object) -> str:
    if isinstance(value, dict):
        return " ".join(f"{key}={item}" for key, item in value.items())
    return "/".join(str(item) for item in value) if isinstance(value, list) else str(value)


def _spans(serial: SerialFacts) -> dict[str, str]:
    """What reads better in other words than a program's."""
    return {
        "units": f"{serial.units[0]}..{serial.units[1]}",
        "reply": f"{serial.reply_usual:g}..{serial.reply_max:g} s",
        "comm_loss": _loss(serial.comm_loss),
    }


def _holes(modbus: ModbusFacts) -> list[str]:
    return [f"{low:04X}H" if low == high else f"{low:04X}H..{high:04X}H" for low, high in modbus.holes]


def _notation_line(notation: Notation) -> str:
    parts = " + ".join(part if w == 1 else f"{w} x {part}" for part, w in notation.weights.items())
    where = "" if notation.table is Registers.HOLDING else f" ({notation.table})"
    add = f" {'-' if notation.add < 0 else '+'} {abs(notation.add):04X}H" if notation.add else ""
    origin = origin_text(notation.provenance)
    return f"address {notation.pattern}: {parts}{add}{where}, like {notation.example} ({origin})"


def _loss(loss: CommLoss) -> str:
    after = loss.after_from or ("?" if loss.after is None else f"{loss.after:g} s")
    when = "".join(f" when {term.text}" for term in loss.when)
    stops = "".join(f", stops the motor if {term.text}" for term in loss.stops_when or ())
    return f"after {after} by {loss.action or '?'}{when}{stops}"


def _setting_line(setting: Setting) -> str:
    facts = setting_object(setting)
    if facts["range"]:
        facts["range"] = "{}..{}".format(*facts["range"])
    shown = [
        f"{key} {_plain(facts[key])}"
        for key in ("unit", "range", "values", "default")
        if facts[key] not in (None, {})
    ]
    notes = [
        text for text in (setting.help, origin_text(setting.provenance), setting.provenance.doubt) if text
    ]
    return f"setting {setting.name}: " + "; ".join([*shown, *notes])


def _error_line(code: int, error: ErrorMeaning) -> str:
    facts = error_object(code, error)
    again = f", again after {error.retry:g} s" if error.retry else ""
    once = "".join(f", again once {term.text}" for term in error.retry_when)
    origin = error.provenance
    about = "; ".join(text for text in (error.help, origin_text(origin), origin.doubt) if text)
    return f"error {facts['code']}: {error.name}{again}{once}" + (f" ({about})" if about else "")


def _only_when(condition: Condition) -> str:
    return f" only when {_listed(condition)}" if condition else ""


def _step_text(step: Step, points: Mapping[str, Point]) -> str:
    when = f"when {_listed(step.when)}: " if step.when else ""
    writes = " ".join(
        f"{name}={_spelled(written(value, points.get(name)))}" for name, value in step.write.items()
    )
    until = f", until {_listed(step.until)}" if step.until else ""
    return f"{when}write {writes}{until}, within {step.within:g} s"


def _listed(condition: Condition) -> str:
    return ", ".join(in_words(condition))


def _spelled(value: float | str) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
