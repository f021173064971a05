"""What a drive ought to show by what was commanded from here, and whether it ought to run. Pure."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping

from gateway.mapping.profile import Kind, Point
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
        self.values: dict[str, Value] = {}
        self.runs: bool | None = None

    def sending(self, names: Iterable[str]) -> None:
        """These points are about to be written: what they, and all that hangs on them, will show is open."""
        written = set(names)
        for name in written:
            point = self._points[name]
            if point.silent or point.danger:
                self.values.clear()
                return
            self.values.pop(name, None)
            self.values.pop(point.twin or "", None)
        for name in list(self.values):
            if not written.isdisjoint(self._deciders(self._points[name])):
                del self.values[name]

    def seen(self, name: str, value: Value) -> None:
        """A point was written, and the drive shows it."""
        point = self._points[name]
        if point.kind in LASTING and not point.pulse and not point.select:
            self.values[name] = value

    def forget(self, runs: bool | None = None) -> None:
        """The drive holds nothing any more of what was commanded."""
        self.values.clear()
        self.runs = runs
