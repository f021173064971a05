"""What any drive shows of itself, by the names that all profiles share."""

from __future__ import annotations

from dataclasses import dataclass

NEAR = 0.5
"""Hz within which speed counts as zero, or as agreeing with its reference."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveState:
    """A drive at one moment. ``frequency`` is in Hz and negative in reverse, ``reference`` has no sign;
    ``faults`` are the names of the profile's fault points that are on."""

    frequency: float
    reference: float
    running: bool
    reverse: bool
    fault: bool
    current: float
    voltage: float
    power: float
    dc_bus: float
    communication_lost: bool
    faults: frozenset[str]
    warning: bool = False
    saves: int = 0
    """Writes so far that used up some of the life of the drive's memory."""

    @property
    def ready(self) -> bool:
        """The drive would obey a run command."""
        return not self.fault

    @property
    def zero_speed(self) -> bool:
        """The shaft stands still."""
        return abs(self.frequency) < NEAR

    @property
    def speed_agree(self) -> bool:
        """The output has reached its reference."""
        return self.running and abs(abs(self.frequency) - self.reference) < NEAR


def named_values(state: DriveState) -> dict[str, float]:
    """The values of the shared point names."""
    return {
        "running": state.running,
        "running_forward": state.running and not state.reverse,
        "running_reverse": state.reverse,
        "ready": state.ready,
        "fault": state.fault,
        "warning": state.warning,
        "zero_speed": state.zero_speed,
        "speed_agree": state.speed_agree,
        "frequency_reference": state.reference,
        "output_frequency": abs(state.frequency),
        "output_current": state.current,
        "output_voltage": state.voltage,
        "output_power": state.power,
        "dc_bus_voltage": state.dc_bus,
        "communication_lost": state.communication_lost,
    }
