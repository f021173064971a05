"""Drives of the shipped profiles on lines in any setting, for scans to find."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from gateway.mapping.profile import Profile, SerialFormat
from gateway.mapping.site import DriveConfig, LineConfig, Rs485
from gateway.mapping.specialise import specialise
from gateway.modbus.framing import FramingName, framing_of
from gateway.scan.ask import Answer
from gateway.scan.order import Plan
from gateway.scan.search import Found, Query, Report, SetTo, search
from gateway.simulator.build import build_drives
from gateway.simulator.drive import Drive
from tests.simulator.plant import shipped

NAMES = ("teco-7200gs", "s2000", "shihlin-sl3")


def profiles() -> list[Profile]:
    return [shipped(name) for name in NAMES]


def format_of(text: str) -> SerialFormat:
    data, parity, stops = text
    return SerialFormat(int(data), "E" if parity == "E" else "O" if parity == "O" else "N", int(stops))


def line_of(
    serial: str, drives: Iterable[tuple[str, int]], framing: FramingName = "rtu", echo: bool = False
) -> LineConfig:
    """A line with drives given as profile and unit."""
    baud, form = serial.split()
    return LineConfig(
        name="north",
        port="simulated:",
        framing=framing,
        baud=int(baud),
        format=format_of(form),
        rs485=Rs485(echo=echo),
        drives=tuple(drive_of(name, unit) for name, unit in drives),
    )


def drive_of(name: str, unit: int) -> DriveConfig:
    profile = shipped(name)
    settings = {
        s.name: s.default if s.default is not None else Fraction(50) for s in profile.settings.values()
    }
    return DriveConfig(
        name=f"drive-{unit}",
        line="north",
        profile=specialise(profile, settings),
        unit=unit,
        settings=settings,
    )


class Wires:
    """Lines in their settings on one port: whoever is not spoken to in his own setting hears nothing.
    Stop bits are nobody's concern."""

    def __init__(self, *lines: LineConfig, noise: Iterable[int] = ()) -> None:
        self.lines = [(line, build_drives(line, {})) for line in lines]
        self.noise = set(noise)
        self.sent: list[bytes] = []
        self.settings: list[str] = []
        self.found: list[Found] = []
        self.now = 1000.0

    def scan(self, plan: Plan) -> Report:
        """Carry a whole scan out."""
        report = Report()
        scan = search(plan, report)
        answer = None
        while True:
            try:
                step = scan.send(answer)
            except StopIteration:
                return report
            answer = None
            if isinstance(step, SetTo):
                self.round = step.round
                self.settings.append(str(step.round.setting))
            elif isinstance(step, Found):
                self.found.append(step)
            else:
                answer = self.answer(step)

    def answer(self, query: Query) -> Answer:
        self.now += 0.1
        setting = self.round.setting
        framing = framing_of(setting.framing)
        frame = framing.encode(query.unit, query.ask.request.pdu)
        self.sent.append(frame)
        if query.unit in self.noise:
            return Answer(None, noise=True)
        for line, drives in self.lines:
            alike = (line.framing, line.baud, line.format.data_bits, line.format.parity)
            if (
                alike == setting.alike
                or not setting.serial
                or (setting.blind and alike[:2] == setting.alike[:2])
            ):
                for drive in drives.values():
                    if (reply := self._heard(drive, frame)) is not None:
                        seeker = framing.seeker(frame, query.ask.request)
                        return Answer(seeker.feed(reply), 0.005)
        return Answer(None)

    def _heard(self, drive: Drive, frame: bytes) -> bytes | None:
        return drive.handle(frame, self.now)
