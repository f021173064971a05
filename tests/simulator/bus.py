"""A master for tests of any make: it speaks to all drives of a line at once, without a wire."""

from __future__ import annotations

from collections.abc import Mapping

from gateway.mapping.site import LineConfig
from gateway.simulator import Options
from gateway.simulator.build import build_drives
from gateway.simulator.drive import Drive
from tests.simulator.master import framed, read, write


class Bus:
    """Time passes only by `wait`. Answers are compared with check values of our own."""

    def __init__(self, line: LineConfig, options: Mapping[str, Options] | None = None) -> None:
        self.drives = build_drives(line, options or {})
        self.now = 1000.0
        self.wait(0)

    @property
    def drive(self) -> Drive:
        """The first one."""
        return next(iter(self.drives.values()))

    def wait(self, seconds: float) -> None:
        self.now += seconds
        for drive in self.drives.values():
            drive.step(self.now)

    def send(self, frame: bytes | str) -> bytes | None:
        """What the line answers to a frame (in hex or as bytes); only one drive may."""
        data = bytes.fromhex(frame) if isinstance(frame, str) else frame
        replies = [reply for drive in self.drives.values() if (reply := drive.handle(data, self.now))]
        assert len(replies) <= 1
        return replies[0] if replies else None

    def says(self, request: str, reply: str | None) -> None:
        """One exchange, byte for byte."""
        assert self.send(request) == (None if reply is None else bytes.fromhex(reply))

    def read(self, address: int, count: int = 1, unit: int = 1) -> list[int]:
        """Registers by a read that must succeed."""
        reply = self.send(read(address, count, unit))
        assert reply is not None and reply[1] == 0x03, reply
        assert framed(*reply[:-2]) == reply
        return [int.from_bytes(reply[at : at + 2], "big") for at in range(3, 3 + 2 * count, 2)]

    def word(self, address: int, unit: int = 1) -> int:
        return self.read(address, 1, unit)[0]

    def read_code(self, address: int, count: int = 1) -> int:
        """The error code of a read that must be refused."""
        return self._code(self.send(read(address, count, 1)), 0x83)

    def write(self, address: int, *words: int, unit: int = 1) -> None:
        """A write that must succeed."""
        reply = framed(unit, 0x10, address >> 8, address & 0xFF, 0, len(words))
        assert self.send(write(address, *words, unit=unit)) == reply

    def code(self, address: int, *words: int) -> int:
        """The error code of a write that must be refused."""
        return self._code(self.send(write(address, *words, unit=1)), 0x90)

    def broadcast(self, address: int, *words: int) -> None:
        """A write to all drives, which nobody answers."""
        assert self.send(write(address, *words, unit=0)) is None

    @staticmethod
    def _code(reply: bytes | None, function: int) -> int:
        assert reply is not None and reply == framed(reply[0], function, reply[2])
        return reply[2]
