"""What turns the motor of a 7200GS: the sources of run and frequency, the ramps, and the ways to stop."""

from __future__ import annotations

from enum import IntEnum

from gateway.simulator.bank import Bank
from gateway.simulator.happening import Options, Panel
from gateway.simulator.motor import Motor
from gateway.simulator.teco_7200gs import registers as reg


class Reaction(IntEnum):
    """What the drive does on a fault: the two upper bits of Sn-08 (line lost) and Sn-12 (external)."""

    DECELERATE = 0b00
    COAST = 0b01
    DECELERATE_FAST = 0b10
    KEEP_RUNNING = 0b11


class Motion:
    """The motor and the commands that reach it, read from the registers at every look.

    ``reaction`` is how the motor was stopped by a fault, None without a fault. ``held_back``: a run bit
    that stood while a fault was reset counts only after it has been taken away.
    """

    def __init__(self, bank: Bank, options: Options) -> None:
        self.motor = Motor(load=options.load)
        self.panel = Panel(run=False)
        self.reaction: Reaction | None = None
        self.held_back = False
        self._bank = bank
        self._speed = options.speed

    def react(self, reaction: Reaction) -> None:
        """Stop as told. After a coast there is nothing left for a later fault to soften."""
        if reaction is not Reaction.KEEP_RUNNING:
            self.reaction = reaction

    def move(self, seconds: float) -> None:
        """Turn the motor for so long."""
        if self._coasting:
            self.motor.coast()
            return
        down = reg.BN_04 if self.reaction is Reaction.DECELERATE_FAST else reg.BN_02
        self.motor.ramp(self._target, self._rate(reg.BN_01), self._rate(down), seconds)

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
        """Hz from the source that Sn-08 and Sn-04 name; nothing is wired to the analog terminals."""
        if not self._bank.words[reg.SN_08] & 0b01:
            return self._bank.get("frequency_command")
        return self._bank.words[reg.AN_01] / 100 if self._bank.words[reg.SN_04] & 0b01 else 0.0

    @property
    def _wanted(self) -> Panel:
        """Run and direction from the source that Sn-08 names."""
        if self._bank.words[reg.SN_08] & 0b10:
            return self.panel
        return Panel(self._bank.on("run"), self._bank.on("reverse"))

    @property
    def _run(self) -> bool:
        return self._wanted.run and self.reaction is None and not self.held_back

    @property
    def _may_reverse(self) -> bool:
        return not self._bank.words[reg.SN_05] & 0b10

    @property
    def _target(self) -> float:
        """Hz, negative in reverse; where Sn-05 forbids reverse the motor stands still."""
        if not self._run:
            return 0.0
        if not self._wanted.reverse:
            return self.reference
        return -self.reference if self._may_reverse else 0.0

    @property
    def _coasting(self) -> bool:
        """The output is off, by a fault or because a stop coasts (Sn-04)."""
        if self.reaction is not None:
            return self.reaction is Reaction.COAST
        return not self._run and bool(self._bank.words[reg.SN_04] & 0b100)

    def _rate(self, time: int) -> float:
        """Hz per second by the ramp time in a register, which counts at least one."""
        return self._speed * self._bank.words[reg.CN_02] / max(self._bank.words[time], 1)
