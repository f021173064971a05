"""What goes wrong beside the wire: power, ports, disk, clocks, hands on panels, and the core itself."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from gateway.mapping.profile import Kind
from gateway.mapping.site import DriveConfig
from gateway.simulator.happening import Panel, PowerCycle, Trip
from tests.line.storm.drives import Drive
from tests.prove.bus import Station
from tests.prove.site import SETPOINT

if TYPE_CHECKING:
    from tests.prove.box import Box


class Troubles:
    """Strikes, each by its name in `scene.TROUBLES`."""

    def __init__(self, box: Box) -> None:
        self._box = box

    def strike(self, what: str, rng: random.Random) -> None:
        """It happens now."""
        box = self._box
        box.count(what)
        drive = rng.choice(box.site.drives)
        getattr(self, f"_{what}")(drive, rng)

    def end(self) -> None:
        """From now on nothing goes wrong any more, and what was wrong is mended."""
        box = self._box
        for line in box.plugged:
            box.plugged[line] = True
        box.dying = -1
        for later in (0.0, 10.0, 20.0):  # the core may just be away
            box.clock.at(box.clock.now + later, self._end_maintenance)

    def _end_maintenance(self) -> None:
        for drive in self._box.site.drives:
            self._box.clients.maintain(drive, False)

    def _station(self, drive: DriveConfig) -> Station:
        return self._box.buses[drive.line].stations[drive.unit]

    def _later(self, seconds: float, drive: Drive) -> None:
        def back() -> None:
            drive.on = True

        self._box.clock.at(self._box.clock.now + seconds, back)

    def _crash(self, drive: DriveConfig, rng: random.Random) -> None:
        """The process dies within the next steps, between any two of its actions."""
        if self._box.dying < 0:
            self._box.dying = rng.choice((0, 0, 1, 2, 3, 5, 8, 20))

    def _reboot(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.die(power=True)

    def _power(self, drive: DriveConfig, rng: random.Random) -> None:
        self._switch_off(drive, PowerCycle(rng.choice((0.05, 0.5, 3.0, 10.0))))

    def _latched(self, drive: DriveConfig, rng: random.Random) -> None:
        self._switch_off(drive, PowerCycle(rng.choice((0.05, 0.5, 3.0)), latched=True))

    def _switch_off(self, drive: DriveConfig, how: PowerCycle) -> None:
        station = self._station(drive)
        station.twin.post(how)
        station.twin.step(station.looked_at(self._box.clock.now))
        station.restarted = self._box.clock.now

    def _away(self, drive: DriveConfig, rng: random.Random) -> None:
        station = self._station(drive)
        station.on = False
        self._later(rng.uniform(0.5, 20.0), station)

    def _trip(self, drive: DriveConfig, rng: random.Random) -> None:
        self._station(drive).twin.post(Trip(_fault_of(drive)))

    def _panel(self, drive: DriveConfig, rng: random.Random) -> None:
        self._station(drive).twin.post(Panel(run=rng.random() < 0.5))

    def _intruder(self, drive: DriveConfig, rng: random.Random) -> None:
        """A foreign master writes our drive's setpoint."""
        point = drive.profile.points[SETPOINT]
        self._box.buses[drive.line].intrude(drive.unit, point.address, rng.randrange(3000))

    def _unplugged(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.unplug(drive.line, rng.uniform(0.5, 10.0))

    def _hang_up(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.unplug(drive.line, 0.0)

    def _stall(self, drive: DriveConfig, rng: random.Random) -> None:
        """The process stands still; bytes go on coming in."""
        self._box.stalled_until = self._box.clock.now + rng.choice((0.003, 0.02, 0.1, 0.3))

    def _clock_jump(self, drive: DriveConfig, rng: random.Random) -> None:
        seconds = rng.choice((0.5, -0.5, 60.0, -60.0, 86400.0 * 365, -3600.0))
        self._box.jump(seconds)

    def _disk_fails(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.safe.share = rng.choice((0.02, 0.2, 1.0))
        self._heal_later(rng)

    def _disk_full(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.safe.disk.room = rng.randint(0, 2000)
        self._heal_later(rng)

    def _disk_hangs(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.safe.hangs_until = self._box.clock.now + rng.choice((0.3, 2.0, 8.0))

    def _heal_later(self, rng: random.Random) -> None:
        box = self._box
        box.clock.at(box.clock.now + rng.uniform(0.5, 10.0), box.safe.heal)

    def _adapter_dies(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.clients.drop(rng.choice(("opcua", "mqtt")))

    def _client_goes(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.clients.go(rng)

    def _maintenance(self, drive: DriveConfig, rng: random.Random) -> None:
        self._box.clients.maintain(drive, rng.random() < 0.5)


def _fault_of(drive: DriveConfig) -> str:
    facts = drive.profile.simulate
    alarms = list(facts.alarms) if facts else []
    bits = [p.name for p in drive.profile.points.values() if p.kind is Kind.FAULT and p.encoding.width == 1]
    return (bits or alarms)[0]
