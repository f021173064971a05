"""How a drive behaves: one model for all makes, made from the profile and its ``simulate`` facts.

Where a document is silent the model takes the case that is worse for a master: a run command that stays
set starts the motor again as soon as the fault is reset. Multi-step speeds, jog, PID and automatic restart
are not modelled; their registers are there and do nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from fractions import Fraction

from gateway.mapping.profile import Point
from gateway.mapping.site import DriveConfig
from gateway.mapping.twin import Simulate
from gateway.simulator.amounts import Amounts
from gateway.simulator.assumed import assumed, fitting
from gateway.simulator.bank import Bank
from gateway.simulator.broadcast import Receiver
from gateway.simulator.display import Display
from gateway.simulator.frame import LineError, Request
from gateway.simulator.happening import Cured, Happening, Options, Panel, PanelSets, PowerCycle, Trip
from gateway.simulator.memory import Memory
from gateway.simulator.motion import COMMANDED, FREQUENCY, Motion
from gateway.simulator.refusal import RefusalError
from gateway.simulator.rules import Rules
from gateway.simulator.state import DriveState, named_values
from gateway.simulator.trouble import Trouble

NEVER = float("-inf")


class TwinModel:
    """One simulated drive behind its Modbus server. Times are seconds of a clock that never falls."""

    def __init__(self, config: DriveConfig, baud: int, options: Options) -> None:
        profile = config.profile
        facts = fitting(profile.simulate or Simulate(), profile.points)
        points = assumed(profile.points, facts)
        self.bank = Bank([(at, at) for at in facts.factory], points, config.settings)
        self._points = points
        self._facts = facts
        self._options = options
        self._serial = profile.serial
        self._amounts = Amounts(self.bank, facts, options)
        self._motion = Motion(self.bank, points, facts, self._amounts, options)
        self._trouble = Trouble(self.bank, profile, facts, points, self._motion)
        self._rules = Rules(self.bank, profile.words, facts, points, self._amounts)
        self._memory = Memory(self.bank, points, facts)
        self._display = Display(self.bank, points, facts)
        layout = profile.broadcast
        self._receiver = Receiver(layout, profile.modbus, config.settings) if layout else None
        self._about = {"unit": config.unit, "baud": baud, "delete_errors": options.delete_errors}
        self._happenings: deque[Happening] = deque()
        self._now = self._heard_at = NEVER
        self._away_until = NEVER
        self._reset_held = False
        self._held: dict[str, bool] = {}
        self._refused = ""
        self._line_errors: set[LineError] = set()
        self._requests = 0
        self._deliver()
        self._power_up()
        self._publish()

    @property
    def state(self) -> DriveState:
        """The drive as it was at the last step."""
        return self._state

    @property
    def away(self) -> bool:
        """The drive restarts and hears nothing."""
        return self._now < self._away_until

    # -- what the line and the world do to it --

    def post(self, happening: Happening) -> None:
        """Let something happen at the next step."""
        if isinstance(happening, Trip | Cured):
            self._trouble.require(happening.fault if isinstance(happening, Trip) else happening.warning)
        self._happenings.append(happening)

    def step(self, now: float) -> None:
        """Let time pass up to ``now``. The line's time-out acts at its own moment, not at ``now``."""
        if self._now == NEVER:
            self._now = self._heard_at = now
        while self._happenings:
            self._undergo(self._happenings.popleft())
        deadline = max(self._heard_at + self._patience, self._now)
        if deadline <= now and self._motion.listens and not self._trouble.line_lost:
            self._move(deadline)
            if self._motion.running:
                self._line_errors.add(LineError.TIMEOUT)
                self._trouble.lose_line()
        self._move(now)
        self._publish()

    def heard(self, now: float) -> None:
        """A sound request for this drive; an alarm for a lost line ends."""
        self._heard_at = now
        self._requests += 1
        trouble = self._trouble
        trouble.line_lost = trouble.line_lost and self._motion.reaction is not None

    def line_error(self, error: LineError) -> None:
        """Latch it."""
        self._line_errors.add(error)
        self._publish()

    def refused(self, reason: str) -> None:
        """Show why the last request was refused."""
        self._refused = reason
        self._publish()

    def write(self, address: int, words: Sequence[int]) -> bool:
        """Take registers over, all or none; False when the drive does not answer that."""
        if self._memory.busy(self._now):
            raise RefusalError("busy")
        self._rules.check(address, words)
        for at, word in enumerate(words, address):
            self.bank.store(at, word)
        self._refused = ""
        touched = self._rules.written(address, len(words))
        if any(point.name in COMMANDED for point in touched):
            self._motion.latched = None
        self._memory.written(touched, self._now)
        self._obey()
        if self._restarts(touched):
            self._away_until = self._now + self._facts.restart_time
            self._power_up()
        self._publish()
        return not any(point.silent for point in touched)

    def broadcast(self, request: Request) -> None:
        """Obey a command to all drives, or ignore it."""
        values = self._receiver.values(request) if self._receiver else None
        if values is None or self._receiver is None or self._memory.busy(self._now):
            return
        if "run" in values:
            self._motion.command(values["run"] != 0, values.get("reverse", 0) != 0)
        if "frequency" in values and FREQUENCY in self._points:
            share = self._amounts.max_frequency / 100 if self._receiver.in_percent else Fraction(1)
            self.bank.set(FREQUENCY, float(values["frequency"] * share))
        for name, value in values.items():
            armed = f"broadcast_{name}"
            if armed in self._points and self.bank.on(armed):
                self.bank.set(name, float(value))
        self._held.update({name: values[name] != 0 for name in _HELD if name in values})
        self._heard_at = self._now
        self._obey()
        self._publish()

    # -- commands and faults --

    def _obey(self) -> None:
        """Act on what a write may have changed."""
        if self.bank.applies(self._facts.initialise_when):
            self._deliver()
        external = self._facts.external_fault
        if external is not None and self._demanded and external.trips not in self._trouble.active:
            action = self._trouble.action(external.action)
            self._trouble.strike(external.trips, action)
        reset = self._reset_input
        if reset and not self._reset_held and self.bank.holds(self._facts.reset_when):
            self._reset_faults()
        self._reset_held = reset
        self._motion.held_back = self._motion.held_back and self._motion.commanded.run

    @property
    def _demanded(self) -> bool:
        """An external fault is commanded."""
        external = self._facts.external_fault
        if external is None:
            return False
        commanded = external.by is not None and self.bank.on(external.by)
        return commanded or self._held.get("external_fault", False)

    @property
    def _reset_input(self) -> bool:
        reset = self._facts.reset
        return (reset is not None and self.bank.on(reset)) or self._held.get("fault_reset", False)

    def _undergo(self, happening: Happening) -> None:
        match happening:
            case Trip(fault):
                self._trouble.strike(fault)
            case Cured(warning):
                self._trouble.cure(warning)
            case Panel():
                self._motion.panel = happening
            case PanelSets(point, raw):
                self.bank.put(point, raw)
                self._memory.keep()
            case PowerCycle(away, latched):
                before = self._motion.wanted if latched else None
                self._power_up()
                self._motion.latched = before
                self._away_until = self._heard_at = self._now + away

    def _reset_faults(self) -> None:
        """Forget the faults, unless the external one is still demanded."""
        if self._demanded:
            return
        self._motion.held_back = self._motion.reaction is not None and not self._options.restart
        self._trouble.reset()
        if self._options.delete_errors:
            self._line_errors.clear()

    def _restarts(self, touched: Sequence[Point]) -> bool:
        wanted = self._facts.restarts
        return any(p.name in wanted and self.bank.exact(p.name) == wanted[p.name].value for p in touched)

    def _deliver(self) -> None:
        """Factory contents, with the ramps and the highest frequency of the options."""
        self._display.forget()
        self._memory.deliver()
        self._amounts.preset(frozenset(self._points))
        self._memory.keep()

    def _power_up(self) -> None:
        """As after the mains came on: nothing commanded, nothing remembered but the parameters."""
        self._display.forget()
        self._memory.power_up()
        self._trouble.forget()
        self._line_errors.clear()
        self._held.clear()
        self._refused = ""
        self._requests = 0
        self._reset_held = False
        self._motion.held_back = False
        self._motion.motor.coast()

    @property
    def _patience(self) -> float:
        """Seconds of silence that the drive bears."""
        loss = self._serial.comm_loss
        after = loss.after if loss.after is not None else self._facts.comm_timeout
        if after is None or loss.action is None or not self.bank.holds(loss.when):
            return float("inf")
        return after

    def _move(self, until: float) -> None:
        self._motion.move(until - self._now)
        self._now = until

    def _publish(self) -> None:
        """Bring state and registers up to date."""
        motor, running = self._motion.motor, self._motion.running
        self._state = DriveState(
            frequency=motor.frequency,
            reference=self._motion.reference,
            running=running,
            reverse=self._motion.reverse,
            fault=self._motion.reaction is not None,
            warning=self._trouble.warning,
            current=motor.current if running else 0.0,
            voltage=motor.voltage,
            power=motor.power,
            dc_bus=motor.dc_bus,
            communication_lost=self._trouble.line_lost,
            faults=frozenset(self._trouble.active),
            saves=self._memory.saves,
        )
        self._display.show(named_values(self._state) | self._records())

    def _records(self) -> dict[str, float]:
        """What a drive shows beside its motor."""
        return {
            **self._about,
            "requests": self._requests & 0xFFFF,
            "reset_input": self._reset_input,
            **{f"refused_{reason}": self._refused == reason for reason in _REFUSALS},
            **{f"{error.value}_error": error in self._line_errors for error in LineError},
        }


_HELD = ("external_fault", "fault_reset")
"""Broadcast levels that stand until the next broadcast."""
_REFUSALS = ("locked", "illegal_address", "illegal_value")
