"""The physics behind a drive's terminals: ramps, and electrical values that follow speed and load.

The figures are plausible for a fan or pump; they are not a motor model.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt

VOLTS_PER_INPUT_VOLT = 1.35
"""DC bus of a six-pulse rectifier under load, per volt between the phases."""


@dataclass(frozen=True, slots=True)
class Nameplate:
    """Rated volts, amperes and hertz of the motor; supply voltage of the drive."""

    voltage: float = 220.0
    current: float = 7.2
    frequency: float = 60.0
    supply: float = 220.0


@dataclass(slots=True)
class Motor:
    """Output frequency in Hz, negative in reverse. ``load`` is the torque at rated speed, 1.0 = rated."""

    nameplate: Nameplate = Nameplate()
    load: float = 0.6
    frequency: float = 0.0
    trend: int = 0
    """1 while accelerating, -1 while decelerating, 0 at constant speed."""

    def ramp(self, target: float, up: float, down: float, seconds: float) -> None:
        """Move towards ``target`` at ``up`` (away from zero) and ``down`` (to zero) Hz per second."""
        if self.frequency * target < 0:
            seconds = self._brake(down, seconds)
        if seconds <= 0 or self.frequency == target:
            self.trend = 0 if self.frequency == target else self.trend
            return
        faster = abs(target) > abs(self.frequency)
        self.trend = 1 if faster else -1
        self._approach(target, (up if faster else down) * seconds)

    def coast(self) -> None:
        """The output is switched off; the drive shows no frequency any more."""
        self.frequency, self.trend = 0.0, 0

    def _brake(self, down: float, seconds: float) -> float:
        """Come down to zero before the direction changes; the seconds that are left."""
        left = seconds - abs(self.frequency) / down
        self.trend = -1
        self._approach(0.0, down * seconds)
        return left

    def _approach(self, target: float, step: float) -> None:
        distance = target - self.frequency
        self.frequency = target if abs(distance) <= step else self.frequency + copysign(step, distance)

    @property
    def speed(self) -> float:
        """Share of rated speed, without its sign."""
        return abs(self.frequency) / self.nameplate.frequency

    @property
    def voltage(self) -> float:
        """Output volts: proportional to frequency up to the rated one."""
        return self.nameplate.voltage * min(self.speed, 1.0)

    @property
    def torque(self) -> float:
        """Share of rated torque: quadratic in speed, more while accelerating, less while braking."""
        return max(self.load * self.speed**2 + 0.3 * self.trend, 0.0)

    @property
    def current(self) -> float:
        """Amperes while the output is on: magnetising and torque current at right angles."""
        return self.nameplate.current * sqrt(0.35**2 + (0.94 * self.torque) ** 2)

    @property
    def power(self) -> float:
        """Kilowatts at the shaft; zero at standstill."""
        return sqrt(3) * self.voltage * self.nameplate.current * 0.85 * self.torque / 1000

    @property
    def dc_bus(self) -> float:
        """Volts of the DC bus: sags under load, rises while the motor brakes."""
        swing = 0.06 * self.speed if self.trend < 0 else -0.03 * self.torque * min(self.speed, 1.0)
        return self.nameplate.supply * VOLTS_PER_INPUT_VOLT * (1 + swing)
