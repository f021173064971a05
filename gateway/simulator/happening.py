"""What can happen to a simulated drive from outside the line, and how one is set up."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Trip:
    """A fault strikes: the name of a fault point of the profile, or of an alarm of its twin. A warning
    (a name that begins so) shows and does not stop the motor."""

    fault: str


@dataclass(frozen=True, slots=True)
class Cured:
    """What a warning warned of has passed."""

    warning: str


@dataclass(frozen=True, slots=True)
class Panel:
    """A hand on the operator panel: obeyed while the drive takes its run command from there."""

    run: bool
    reverse: bool = False


@dataclass(frozen=True, slots=True)
class PanelSets:
    """A hand on the panel changes a parameter or a mode: the name of a point, and its raw value."""

    point: str
    raw: int


@dataclass(frozen=True, slots=True)
class PowerCycle:
    """The mains go, and return after ``away`` seconds: commands and faults are forgotten, parameters are
    kept. ``latched``: a motor that was running starts again by itself, although the run bit is not set; it
    runs until the line writes a run command or a stop."""

    away: float = 0.0
    latched: bool = False


Happening = Trip | Cured | Panel | PanelSets | PowerCycle


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How a drive is set up before it is put on the line. Times are seconds between standstill and
    ``max_frequency`` (Hz); None: as its factory. ``turnaround`` is from the end of a request to the start
    of the reply.
    ``load`` is the torque at rated speed (1.0 = rated). ``speed`` lets the motor ramp that many times
    faster. ``delete_errors``: a fault reset clears the record of line errors. ``restart``: a reset lets
    a run bit that still stands start the motor again."""

    max_frequency: float | None = None
    acceleration: float | None = None
    deceleration: float | None = None
    fast_deceleration: float | None = None
    turnaround: float = 0.005
    load: float = 0.6
    speed: float = 1.0
    delete_errors: bool = False
    restart: bool = True
