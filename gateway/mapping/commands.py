"""From the raw commands to commands whose steps are known to fit one transaction each."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType

from gateway.mapping import forms
from gateway.mapping.facts import WRITE_MANY, WRITE_ONE
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Level, Sources
from gateway.mapping.model import Command as RawCommand
from gateway.mapping.model import Step as RawStep
from gateway.mapping.node import Path
from gateway.mapping.profile import (
    Argument,
    Command,
    Condition,
    Constant,
    Kind,
    ModbusFacts,
    Point,
    Step,
    Term,
)
from gateway.mapping.shape import nearest
from gateway.mapping.values import Conditions, in_words, single_value
from gateway.tag import Role

STOP = "stop"
"""The command that overtakes everything."""
STOP_ALL = "stop_all"
"""The broadcast command that stops every drive."""
RUNNING = "running"
_HELD = (Kind.PARAMETER, Kind.SETPOINT)
"""Kinds that hold what was last written: no drive changes them by itself."""


class CommandMaker:
    """Makes the commands of one profile."""

    def __init__(
        self,
        points: Mapping[str, Point],
        modbus: ModbusFacts,
        conditions: Conditions,
        sources: Sources,
        report: Report,
    ) -> None:
        self._points = points
        self._modbus = modbus
        self._conditions = conditions
        self._sources = sources
        self._report = report

    def make(self, name: str, raw: RawCommand, levels: list[Level]) -> Command:
        """One command."""
        path = levels[-1][0]
        self._check_args(raw, path)
        steps = tuple(self._step(step, raw, (*path, "steps", i)) for i, step in enumerate(raw.steps))
        if name == STOP and steps and steps[-1].until:
            self._check_stops(steps[-1].until, (*path, "steps", len(steps) - 1, "until"))
        return Command(
            name=name,
            args=MappingProxyType(dict(raw.args)),
            steps=steps,
            only_when=self._conditions.find(raw.only_when, (*path, "only_when")),
            role=self._role(steps),
            urgent=name == STOP,
            help=raw.help or "",
            provenance=self._sources.of(levels),
        )

    def _role(self, steps: tuple[Step, ...]) -> Role:
        """The least role that covers everything the command writes."""
        roles = [
            p.role for step in steps for name in step.write if (p := self._points[name]).role is not None
        ]
        return max([Role.OPERATOR, *roles], key=list(Role).index)

    def _check_args(self, raw: RawCommand, path: Path) -> None:
        filled = {
            p.name for step in raw.steps for text in step.write.values() if (p := forms.placeholder(text))
        }
        for name, point in raw.args.items():
            if point not in self._points:
                remedy = nearest(point, list(self._points))
                self._report.unknown_name((*path, "args", name), point, f"`{point}` is no point", remedy)
        unused = [name for name in raw.args if name not in filled]
        misspelled = len(filled - raw.args.keys())
        for name in unused[misspelled:] if not self._report.lost.inside(path) else ():
            message = f"the argument `{name}` is never used"
            remedy = f"write <{name}> in a step, or leave it out"
            self._report.error((*path, "args", name), message, remedy, key=True)

    def _step(self, raw: RawStep, command: RawCommand, path: Path) -> Step:
        write: dict[str, Constant | Argument] = {}
        for name, text in raw.write.items():
            value = self._value(name, text, command, (*path, "write", name))
            if value is not None:
                write[name] = value
        if not raw.write:
            self._report.error((*path, "write"), "the step writes nothing", "name at least one point")
        known = [point for name in raw.write if (point := self._points.get(name)) is not None]
        if len(known) == len(raw.write) and all(point.access.writable for point in known):
            self._check_together(known, (*path, "write"))
        if raw.within <= 0:
            self._report.error((*path, "within"), "no time is left for the proof", "write a time like 2s")
        until = self._conditions.find(raw.until, (*path, "until"))
        for term in until:
            if term.name in write or term.name not in raw.write:
                self._check_provable(term, write, (*path, "until", term.name))
        when = self._conditions.find(raw.when, (*path, "when"))
        return Step(MappingProxyType(write), until, raw.within, when)

    def _check_stops(self, until: Condition, path: Path) -> None:
        """Warn of a stop that would be confirmed while the motor turns."""
        if RUNNING in self._points and not any(term.name == RUNNING for term in until):
            message = f"`{STOP}` is proved without `{RUNNING}`, so it may be confirmed while the motor turns"
            self._report.warn(path, message, f"write {{{RUNNING}: false}}", key=True)

    def _check_provable(self, term: Term, write: Mapping[str, Constant | Argument], path: Path) -> None:
        """Warn of a proof that the writes of its step cannot bring about."""
        point, written = self._points.get(term.name), write.get(term.name)
        if term.setting:
            message = f"`{term.name}` is a setting, which no write changes"
        elif isinstance(written, Constant) and not _may_become(term, written):
            message = f"the step itself writes another value to `{term.name}`"
        elif point is not None and written is None and point.kind in _HELD:
            message = f"`{term.name}` holds what was written last, and this step does not write it"
        else:
            return
        self._report.warn(path, message, "name what the write brings about", key=True)

    def _value(self, name: str, text: str, command: RawCommand, path: Path) -> Constant | Argument | None:
        """What a step writes to a point; None, with a finding, when it cannot."""
        point = self._points.get(name)
        if point is None:
            remedy = nearest(name, list(self._points))
            self._report.unknown_name(path, name, f"`{name}` is no point", remedy, key=True)
            return None
        if not point.access.writable:
            self._report.error(path, f"`{name}` cannot be written", "name a point that can", key=True)
        filled = forms.placeholder(text)
        if filled is None:
            return self._constant(text, point, path)
        if filled.name not in command.args:
            self._report.error(
                path,
                f"`<{filled.name}>` is no argument of the command",
                nearest(filled.name, list(command.args)),
            )
        elif self._points.get(command.args[filled.name]) not in (None, point):
            self._check_lent(point, self._points[command.args[filled.name]], path)
        if point.danger:
            self._harmful(next(iter(point.danger.values())), path)
        return Argument(filled.name, filled.negate)

    def _check_lent(self, point: Point, lender: Point, path: Path) -> None:
        """An argument that was checked in one point's terms must mean the same in another's."""
        ours, theirs = point.encoding, lender.encoding
        if (ours.symbol, ours.value_type, ours.values) != (theirs.symbol, theirs.value_type, theirs.values):
            self._report.error(
                path,
                f"`{point.name}` and `{lender.name}` do not mean the same",
                "let the argument take its unit from the point that is written",
            )

    def _constant(self, text: str, point: Point, path: Path) -> Constant | None:
        try:
            value = single_value(text, point)
        except FormError as error:
            self._report.error(path, error.message, error.remedy)
            return None
        limits = point.limits
        for bound, outside in ((limits.low, value.__lt__), (limits.high, value.__gt__)) if limits else ():
            if not isinstance(bound, str) and outside(bound):
                self._report.error(
                    path,
                    f"{text} is beyond the limit {in_words(bound)} of `{point.name}`",
                    "correct the value or the range",
                )
        if int(value) in point.danger and point.encoding.scale == 1:
            self._harmful(point.danger[int(value)], path)
        return Constant(value)

    def _harmful(self, what: str, path: Path) -> None:
        self._report.warn(path, f"this does harm: {what}", "be sure that it is wanted")

    def _check_together(self, points: list[Point], path: Path) -> None:
        """One step is one frame: its registers must lie together and fit one request."""
        if len({point.table for point in points}) > 1:
            self._report.error(path, "the step writes two tables", "make it two steps", key=True)
            return
        spans = sorted({(point.address, point.address + point.words) for point in points})
        for (_, end), (start, _) in pairwise(spans):
            if start != end:
                self._report.error(
                    path,
                    f"{end - 1:04X}H and {start:04X}H do not lie together",
                    "make it two steps",
                    key=True,
                )
        registers = sum(end - start for start, end in spans)
        if registers > self._modbus.write_max:
            self._report.error(
                path,
                f"the step writes {registers} registers, the drive takes {self._modbus.write_max}",
                "make it two steps",
                key=True,
            )
        functions = self._modbus.functions
        if registers > 1 and WRITE_MANY not in functions and WRITE_ONE in functions:
            self._report.error(
                path, "the drive cannot write two registers at once", "make it two steps", key=True
            )


def _may_become(term: Term, written: Constant) -> bool:
    """True when a point can have the value of the term after this was written: it stays, or the drive sets
    it back to 0 when it is done."""
    return any(low <= value <= high for low, high in term.ranges for value in (written.value, 0))
