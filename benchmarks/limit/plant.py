"""The site that is measured: its file, its users, and what is wanted of its drives."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.wire.settings import LineSettings
from gateway.mapping.load import builtin_mappings, load_profile
from gateway.tag import Role
from gateway.users import add_user

SITE = "bench"
USER, PASSWORD = "operator", "a password for measuring"
REGISTERS = (*range(0x20, 0x25), *range(0x27, 0x2E), *range(0x31, 0x34), 0x3D, 0x3E)
"""The 17 registers that are wanted of each drive; holes make four reads of them."""
ENDS = (0x20, 0x24, 0x27, 0x2D, 0x31, 0x33, 0x3D, 0x3E)
"""First and last register of these reads."""
PERIOD = 0.05
"""Seconds; what the OPC UA client wants of everything, which no line here can hold."""
FAST_PROFILE = """\
profile: {name}
like: teco-7200gs
serial:
  baud: [9600, 115200]
  rtu: [8N1, 8N2]
  units: {{is: 1..32}}
"""
PROFILE = "measured-drive"


@dataclass(slots=True)
class Plant:
    """Lines with drives; ``silent`` of them per line do not answer."""

    lines: int = 1
    drives: int = 8
    baud: int = 9600
    form: str = "8N2"
    silent: int = 0
    pieces: int = 0
    hold: float = 0.0
    names: list[str] = field(init=False)

    def __post_init__(self) -> None:
        self.names = [f"line-{number + 1}" for number in range(self.lines)]

    def drive(self, line: str, unit: int) -> str:
        """The name of a drive."""
        return f"{line.replace('line', 'fan')}-{unit}"

    def drives_of(self, line: str) -> list[str]:
        """The names of the drives on a line."""
        return [self.drive(line, unit) for unit in range(1, self.drives + 1)]

    @property
    def all_drives(self) -> list[str]:
        """The names of all drives."""
        return [drive for line in self.names for drive in self.drives_of(line)]

    @property
    def silent_units(self) -> list[int]:
        """Units of each line that do not answer: spread over the line."""
        step = self.drives / max(1, self.silent)
        return [1 + int(step * (number + 0.5)) for number in range(self.silent)]

    def wire(self, name: str) -> LineSettings:
        """How the emulated line of that name is set up."""
        bits = 1 + int(self.form[0]) + (self.form[1] != "N") + int(self.form[2])
        units = list(range(1, self.drives + 1))
        return LineSettings(
            name, self.baud, bits, units, pieces=self.pieces, hold=self.hold, silent=self.silent_units
        )


def points() -> list[str]:
    """The points that lie in the wanted registers: first one of each register, those at the ends of the reads
    before the others, then the rest."""
    profile, findings = load_profile(builtin_mappings() / "teco-7200gs.yaml")
    if profile is None:
        raise RuntimeError("; ".join(map(str, findings)))
    by_register: dict[int, list[str]] = {register: [] for register in (*ENDS, *REGISTERS)}
    for point in profile.points.values():
        if point.access.readable and point.address in by_register:
            by_register[point.address].append(point.name)
    firsts = [names[0] for names in by_register.values()]
    return firsts + [name for names in by_register.values() for name in names[1:]]


def write_site(folder: Path, plant: Plant, port: int, broker: str) -> Path:
    """The site file of a plant, with an operator who may command."""
    (folder / "profiles").mkdir()
    (folder / "profiles" / f"{PROFILE}.yaml").write_text(FAST_PROFILE.format(name=PROFILE), encoding="utf-8")
    users = folder / "users.json"
    add_user(users, USER, Role.ENGINEER, PASSWORD)
    path = folder / "site.yaml"
    path.write_text(_text(plant, port, broker, users), encoding="utf-8")
    return path


def _text(plant: Plant, port: int, broker: str, users: Path) -> str:
    lines = "\n".join(_line(plant, name) for name in plant.names)
    return f"""\
site: {SITE}
gateway: gw
profiles: [profiles]
lines:
{lines}
rates: {{fast: {PERIOD * 1000:.0f}ms, normal: 1s, slow: 30s}}
writes: {{enabled: true}}
opcua:
  endpoint: opc.tcp://127.0.0.1:{port}
  security: [none]
  anonymous: read
  users_file: {users}
mqtt:
  - broker: {broker}
    commands: {{role: engineer}}
    publish: [{{points: [{", ".join(points())}], rate: normal}}]
data: data
"""


def _line(plant: Plant, name: str) -> str:
    drives = "\n".join(
        f"      {plant.drive(name, unit)}: {{profile: {PROFILE}, unit: {unit}, control: {{lease: off}}}}"
        for unit in range(1, plant.drives + 1)
    )
    return f"  {name}:\n    port: /dev/{name}\n    serial: {plant.baud} {plant.form}\n    drives:\n{drives}"
