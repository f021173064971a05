"""The behaviour of the 7200GS: faults and their reset, the line and its loss, writes."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from gateway.mapping.profile import Kind
from gateway.mapping.site import DriveConfig
from gateway.simulator.bank import Bank, UnsupportedError
from gateway.simulator.frame import LineError
from gateway.simulator.happening import Happening, Options, Panel, PowerCycle, Trip
from gateway.simulator.refusal import Reason
from gateway.simulator.state import DriveState
from gateway.simulator.teco_7200gs import registers as reg
from gateway.simulator.teco_7200gs import status
from gateway.simulator.teco_7200gs.motion import Motion, Reaction

NEEDED = (
    "run",
    "reverse",
    "external_fault",
    "fault_reset",
    "frequency_command",
    "fault_external",
    "fault_low_voltage",
)
"""Points that this model looks up by name."""
COMMUNICATION_TIMEOUT = 2.0
"""Seconds; section 4, table of switch S2."""
COMMUNICATION_FAULT = 0xE
"""In the fault history. The manual lists no codes; all others are the bit in 0021H plus one."""

NEVER = float("-inf")


class Teco7200gs:
    """The drive behind the SI-M card. Implements `gateway.simulator.drive.Model`."""

    def __init__(self, config: DriveConfig, baud: int, options: Options) -> None:
        self._points = config.profile.points
        if missing := [name for name in NEEDED if name not in self._points]:
            raise UnsupportedError(f"profile {config.profile.name} has no point {', '.join(missing)}")
        self.bank = Bank(reg.SPANS, self._points)
        self._motion = Motion(self.bank, options)
        self._options = options
        self._faults = tuple(
            p.name for p in self._points.values() if p.kind is Kind.FAULT and p.encoding.width == 1
        )
        self._happenings: deque[Happening] = deque()
        self._now = self._heard_at = NEVER
        self._line_lost = False
        self._reset_held = False
        switches = reg.dip_switches(config.unit, baud, delete_errors=options.delete_errors)
        self.bank.words[reg.DIP_SWITCHES] = switches
        self._reset_parameters()
        self._power_up()
        self._publish()

    @property
    def state(self) -> DriveState:
        """The drive as it was at the last step."""
        return self._state

    # -- what the line and the world do to it --

    def post(self, happening: Happening) -> None:
        """Let something happen at the next step."""
        if isinstance(happening, Trip) and happening.fault not in self._faults:
            raise UnsupportedError(f"{happening.fault} is no fault of the profile")
        self._happenings.append(happening)

    def step(self, now: float) -> None:
        """Let time pass up to ``now``. The line's time-out acts at its own moment, not at ``now``."""
        if self._now == NEVER:
            self._now = self._heard_at = now
        while self._happenings:
            self._undergo(self._happenings.popleft())
        deadline = max(self._heard_at + COMMUNICATION_TIMEOUT, self._now)
        if deadline <= now and reg.listens(self.bank.words) and not self._line_lost:
            self._move(deadline)
            if self._motion.running:
                self._lose_line()
        self._move(now)
        self._publish()

    def heard(self, now: float) -> None:
        """A sound request for this drive; an alarm for a lost line ends."""
        self._heard_at = now
        status.count_scan(self.bank)
        self._line_lost = self._line_lost and self._motion.reaction is not None

    def line_error(self, error: LineError) -> None:
        """Latch the bit in 003DH."""
        self.bank.words[reg.LINE_ERRORS] |= status.LINE_ERROR_BITS[error]

    def refused(self, reason: Reason) -> None:
        """Show in 0022H why the last request was refused."""
        self.bank.words[reg.DATA_LINK] = status.DATA_LINK_BITS.get(reason, 0)

    def write(self, address: int, words: Sequence[int]) -> None:
        """Take registers over, all or none."""
        undervoltage = self.bank.on("fault_low_voltage")
        for at, value in enumerate(words, address):
            reg.check_write(
                at, value, self.bank.words, running=self._motion.running, undervoltage=undervoltage
            )
        self.bank.words.update(enumerate(words, address))
        self.bank.words[reg.DATA_LINK] = 0
        self._obey()
        self._publish()

    # -- commands and faults --

    def _obey(self) -> None:
        """Act on what a write may have changed."""
        if self.bank.words[reg.SN_03] in reg.INITIALISE:
            self._reset_parameters()
        if self.bank.on("external_fault") and not self.bank.on("fault_external"):
            self._trip("fault_external", Reaction(self.bank.words[reg.SN_12] >> 2))
        reset = self.bank.on("fault_reset")
        if reset and not self._reset_held:
            self._reset_faults()
        self._reset_held = reset
        self._motion.held_back = self._motion.held_back and self.bank.on("run")

    def _undergo(self, happening: Happening) -> None:
        match happening:
            case Trip(fault):
                self._trip(fault, Reaction.COAST)
            case Panel():
                self._motion.panel = happening
            case PowerCycle():
                self._power_up()

    def _trip(self, fault: str, reaction: Reaction) -> None:
        self.bank.set(fault, True)
        status.remember_fault(self.bank, (self._points[fault].encoding.bit + 1) & 0xF)
        self._motion.react(reaction)

    def _lose_line(self) -> None:
        self._line_lost = True
        self.line_error(LineError.TIMEOUT)
        status.remember_fault(self.bank, COMMUNICATION_FAULT)
        self._motion.react(Reaction(self.bank.words[reg.SN_08] >> 2))

    def _reset_faults(self) -> None:
        """Forget the faults, unless the external one is still demanded."""
        if self.bank.on("external_fault"):
            return
        self._motion.held_back = self._motion.reaction is not None and not self._options.restart
        self._motion.reaction, self._line_lost = None, False
        self.bank.clear(self._faults)
        if self._options.delete_errors:
            self.bank.words[reg.LINE_ERRORS] = 0

    def _power_up(self) -> None:
        """As after the mains came on: nothing commanded, nothing remembered but the parameters."""
        for low, high in reg.CONTROL + reg.MONITOR[:-1] + ((reg.LINE_ERRORS, reg.DIP_SWITCHES - 1),):
            self.bank.words.update(dict.fromkeys(range(low, high + 1), 0))
        self._line_lost = False
        self._reset_held = False
        self._motion.held_back = False
        self._motion.reaction = None
        self._motion.motor.coast()

    def _move(self, until: float) -> None:
        self._motion.move(until - self._now)
        self._now = until

    def _reset_parameters(self) -> None:
        """Factory contents, with the ramps and the highest frequency of the options."""
        for low, high in reg.SN + reg.CN + reg.AN + reg.BN:
            self.bank.words.update({at: reg.DEFAULTS.get(at, 0) for at in range(low, high + 1)})
        tenths = {
            reg.CN_02: self._options.max_frequency,
            reg.BN_01: self._options.acceleration,
            reg.BN_02: self._options.deceleration,
            reg.BN_04: self._options.fast_deceleration,
        }
        self.bank.words.update({at: round(value * 10) for at, value in tenths.items()})

    def _publish(self) -> None:
        """Bring state and monitor registers up to date."""
        motor, running = self._motion.motor, self._motion.running
        self._state = DriveState(
            frequency=motor.frequency,
            reference=self._motion.reference,
            running=running,
            reverse=self._motion.reverse,
            fault=self._motion.reaction is not None,
            current=motor.current if running else 0.0,
            voltage=motor.voltage,
            power=motor.power,
            dc_bus=motor.dc_bus,
            communication_lost=self._line_lost,
            faults=frozenset(name for name in self._faults if self.bank.on(name)),
        )
        status.publish(self.bank, self._state, undervoltage=self.bank.on("fault_low_voltage"))
