"""What turns the motor: the sources of run and frequency, the ramps, and the ways to stop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gateway.mapping.profile import Point
from gateway.mapping.twin import Reaction, Simulate
from gateway.simulator.amounts import Amounts
from gateway.simulator.bank import Bank
from gateway.simulator.happening import Options, Panel
from gateway.simulator.motor import Motor

RUN, REVERSE, RUN_COMMAND, DIRECTION, FREQUENCY = (
    "run",
    "reverse",
    "run_command",
    "direction",
    "frequency_command",
)
"""The names that all profiles share."""
COMMANDED = (RUN, RUN_COMMAND)
"""The points by which the line runs and stops the motor."""
_FORWARD = ("forward", "run")


@dataclass(frozen=True, slots=True)
class Latched:
    """Direction and frequency (Hz) that a drive goes on with after its mains returned."""

    reverse: bool
    frequency: float


class Motion:
    """The motor and the commands that reach it, read from the registers at every look.

    ``reaction`` is how the motor was stopped by a fault, None without a fault. ``held_back``: a run
    command that stood while a fault was reset counts only after it has been taken away. ``latched`` is what
    the drive remembers over a loss of its mains, and does until the line commands it anew.
    """

    def __init__(
        self, bank: Bank, points: Mapping[str, Point], facts: Simulate, amounts: Amounts, options: Options
    ) -> None:
        self.motor = Motor(load=options.load)
        self.panel = Panel(run=False)
        self.reaction: Reaction | None = None
        self.held_back = False
        self.latched: Latched | None = None
        self._bank = bank
        self._points = points
        self._facts = facts
        self._amounts = amounts
        self._speed = options.speed

    def react(self, reaction: Reaction) -> None:
        """Stop as told. After a coast there is nothing left for a later fault to soften."""
        if reaction != "keep_running":
            self.reaction = reaction

    def move(self, seconds: float) -> None:
        """Turn the motor for so long."""
        if self._coasting:
            self.motor.coast()
            return
        down = "fast_deceleration" if self.reaction == "decelerate_fast" else "deceleration"
        self.motor.ramp(self._target, self._rate("acceleration"), self._rate(down), seconds)

    @property
    def running(self) -> bool:
        """The output is on: a run command is obeyed, or the motor has not come to rest."""
        return self._run or self.motor.frequency != 0

    @property
    def reverse(self) -> bool:
        """The output turns in reverse, or is about to from standstill."""
        if self.motor.frequency != 0:
            return self.motor.frequency < 0
        return self._run and self._wanted.reverse and self._may_reverse

    @property
    def reference(self) -> float:
        """Hz from the source that the drive obeys; 0 where nothing is wired or chosen."""
        if self.latched is not None:
            return self.latched.frequency
        if self._bank.holds(self._facts.frequency_when):
            return self._bank.get(FREQUENCY) if FREQUENCY in self._points else 0.0
        source = self._facts.panel_frequency
        if source is None or not self._bank.holds(self._facts.panel_frequency_when):
            return 0.0
        return self._bank.get(source)

    @property
    def listens(self) -> bool:
        """Run or frequency comes from the line, whose loss therefore matters."""
        bank, facts = self._bank, self._facts
        return bank.holds(facts.run_when) or bank.holds(facts.frequency_when)

    @property
    def commanded(self) -> Panel:
        """Run and direction as the line has written them."""
        if RUN in self._points:
            return Panel(self._bank.on(RUN), REVERSE in self._points and self._bank.on(REVERSE))
        word = self._named(RUN_COMMAND)
        if word == "reverse":
            return Panel(run=True, reverse=True)
        return Panel(word in _FORWARD, self._named(DIRECTION) == "reverse")

    @property
    def wanted(self) -> Latched | None:
        """What the motor does now, None while it is not to run."""
        return Latched(self._wanted.reverse, self.reference) if self._run else None

    def command(self, run: bool, reverse: bool) -> None:
        """Write run and direction as the line would."""
        self.latched = None
        if RUN in self._points:
            self._bank.set(RUN, run)
            if REVERSE in self._points:
                self._bank.set(REVERSE, reverse)
            return
        word = ("reverse" if reverse else "forward") if run else "stop"
        raws = [raw for raw, name in self._values(RUN_COMMAND).items() if name == word]
        for raw in raws:
            self._bank.put(RUN_COMMAND, raw)

    def _named(self, name: str) -> str:
        """The name of a point's present value; empty without the point."""
        return self._values(name).get(self._bank.raw(name), "") if name in self._points else ""

    def _values(self, name: str) -> Mapping[int, str]:
        return self._points[name].encoding.values if name in self._points else {}

    @property
    def _wanted(self) -> Panel:
        """Run and direction from the source that the drive obeys."""
        if self.latched is not None:
            return Panel(run=True, reverse=self.latched.reverse)
        return self.commanded if self._bank.holds(self._facts.run_when) else self.panel

    @property
    def _run(self) -> bool:
        return self._wanted.run and self.reaction is None and not self.held_back

    @property
    def _may_reverse(self) -> bool:
        return not self._bank.applies(self._facts.forward_only_when)

    @property
    def _target(self) -> float:
        """Hz, negative in reverse; where reverse is forbidden the motor stands still."""
        if not self._run:
            return 0.0
        if not self._wanted.reverse:
            return self.reference
        return -self.reference if self._may_reverse else 0.0

    @property
    def _coasting(self) -> bool:
        """The output is off, by a fault or because a stop coasts."""
        if self.reaction is not None:
            return self.reaction == "coast"
        return not self._run and self._bank.applies(self._facts.coast_when)

    def _rate(self, ramp: str) -> float:
        """Hz per second."""
        return self._speed * float(self._amounts.base_frequency / self._amounts.seconds(ramp))
