"""What a drive ought to show by what was commanded from here, and whether it ought to run. Pure."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping

from gateway.mapping.profile import Kind, Point
from gateway.modbus.encoding import decode, insert
from gateway.tag import Value

LASTING = (Kind.SETPOINT, Kind.COMMAND, Kind.SWITCH)
"""Kinds whose value no drive changes by itself while it is on."""


class Expected:
    """The values that were written and seen on the drive, by point, and what was commanded of the motor.

    ``runs`` is True from the moment at which a run command leaves, False once a stop is confirmed, and None
    while neither can be said: nobody commanded it since this gateway started, or a stop is under way.
    ``deciders`` tells on which others the meaning of a point depends.
    """

    def __init__(self, points: Mapping[str, Point], deciders: Callable[[Point], Collection[str]]) -> None:
        self._points = points
        self._deciders = deciders
        self.sources: frozenset[str] = frozenset()
        """Parameters that decide whether the line is obeyed: they are remembered too."""
        self.values: dict[str, Value] = {}
        self.unseen: dict[str, Value] = {}
        """What was written and obeyed, and not read back yet."""
        self.runs: bool | None = None
        self.obeys: bool | None = None
        """Whether the drive obeyed the line when it was last looked at."""

    def sending(self, names: Iterable[str]) -> None:
        """These points are about to be written: what they, and all that hangs on them, will show is open."""
        written = set(names)
        for name in written:
            point = self._points[name]
            if point.silent or point.danger:
                self.forget(runs=False if point.silent else self.runs)
                break
            self.unseen.pop(name, None)
            self.values.pop(name, None)
            self.values.pop(point.twin or "", None)
        for name in list(self.values):
            if not written.isdisjoint(self._deciders(self._points[name])):
                del self.values[name]

    def obeyed(self, raws: Mapping[str, int]) -> None:
        """These raw values were written, and the drive does what they command."""
        for name, raw in raws.items():
            point = self._points[name]
            cut = point.encoding
            known = point.kind is Kind.COMMAND and point.access.readable and cut.width and not point.pulse
            if known and not point.cases and not point.select:
                self.unseen[name] = decode(cut, (insert(cut, raw, 0),)).value

    def look_at(self, shown: Mapping[str, Value]) -> None:
        """What the drive shows: it is expected to go on showing what was written there."""
        for name in [name for name in self.unseen if name in shown]:
            if self.unseen.pop(name) == shown[name]:
                self.values[name] = shown[name]

    def seen(self, name: str, value: Value) -> None:
        """A point was written, and the drive shows it."""
        point = self._points[name]
        lasting = point.kind in LASTING and not point.pulse and not point.select
        if lasting or name in self.sources:
            self.values[name] = value

    def leaving(self, *, starts: bool, stops: bool, may_start: bool) -> None:
        """A frame leaves: of a command that starts the motor, of one that stops it, or of something that may
        do either."""
        if stops:
            self.runs = None
        elif starts:
            self.runs = True
        elif may_start and self.runs is False:
            self.runs = None

    def forget(self, runs: bool | None = None) -> None:
        """The drive holds nothing any more of what was commanded."""
        self.values.clear()
        self.unseen.clear()
        self.runs = runs
        self.obeys = None
