"""The lines that captured frames come from, as both forms of a trace name them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

from gateway.bridge.api import Frame
from gateway.mapping.site import LineConfig
from gateway.modbus.framing import FramingName


class CaptureError(ValueError):
    """A file is no trace of ours; the message says what is wrong with it."""


@dataclass(frozen=True, slots=True)
class Source:
    """A line: its name, its framing, its speed and format (``9600 8N2``, empty on Modbus TCP), its port."""

    name: str
    framing: FramingName
    serial: str
    port: str

    @property
    def baud(self) -> int | None:
        """Bits a second; None on Modbus TCP."""
        return int(self.serial.split()[0]) if self.serial else None

    @property
    def description(self) -> str:
        """Everything but the name: ``rtu 9600 8N2 on /dev/ttyUSB0``."""
        how = f"{self.framing} {self.serial}" if self.serial else self.framing
        return f"{how} on {self.port}"


class Captured(NamedTuple):
    """A frame and the line that it was on."""

    source: Source
    frame: Frame


_FRAMINGS: dict[str, FramingName] = {"rtu": "rtu", "ascii": "ascii", "tcp": "tcp"}
_DESCRIPTION = re.compile(r"(rtu|ascii|tcp)(?: (\d+ \d[NEO]\d))? on (.*)")


def source_of(line: LineConfig) -> Source:
    """A line of a site."""
    serial = "" if line.framing == "tcp" else f"{line.baud} {line.format}"
    return Source(line.name, line.framing, serial, line.port)


def described(name: str, description: str) -> Source:
    """The line with that `Source.description`. Raises `CaptureError` when it is none."""
    match = _DESCRIPTION.fullmatch(description)
    if match is None:
        raise CaptureError(f"{description!r} does not describe a line")
    framing, serial, port = match.groups()
    return Source(name, _FRAMINGS[framing], serial or "", port)
