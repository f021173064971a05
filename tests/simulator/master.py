"""A master for tests: requests by hand, with a check value worked out bit by bit as the manual does."""

from __future__ import annotations

from gateway.simulator.drive import Drive

UNIT = 5


def crc(data: bytes) -> bytes:
    """Section 7 (4) of the SI-M manual, steps A to G, low byte first."""
    register = 0xFFFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register, lowest = register >> 1, register & 1
            if lowest:
                register ^= 0xA001
    return register.to_bytes(2, "little")


def framed(*content: int) -> bytes:
    """A frame with its check value."""
    return bytes(content) + crc(bytes(content))


def read(address: int, count: int, unit: int = UNIT) -> bytes:
    """A request of function 03H."""
    return framed(unit, 0x03, address >> 8, address & 0xFF, count >> 8, count & 0xFF)


def write(address: int, *words: int, unit: int = UNIT) -> bytes:
    """A request of function 10H."""
    content = [part for word in words for part in (word >> 8, word & 0xFF)]
    return framed(unit, 0x10, address >> 8, address & 0xFF, 0, len(words), len(content), *content)


def refused(function: int, code: int, unit: int = UNIT) -> bytes:
    """An error reply."""
    return framed(unit, function | 0x80, code)


class Master:
    """Talks to one drive directly, without a wire; time passes only by `wait`."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.now = 1000.0

    def wait(self, seconds: float, *, polling: bool = True) -> None:
        """Let time pass; a polling master asks once a second, so that the drive does not miss it."""
        end = self.now + seconds
        while polling and self.now + 1 < end:
            self.now += 1
            assert self.drive.handle(read(0x0020, 1), self.now)
        self.now = end
        self.drive.step(end)

    def send(self, frame: bytes) -> bytes | None:
        """One exchange."""
        return self.drive.handle(frame, self.now)

    def write(self, address: int, *words: int) -> None:
        """A write that must succeed."""
        reply = framed(UNIT, 0x10, address >> 8, address & 0xFF, 0, len(words))
        assert self.send(write(address, *words)) == reply

    def code(self, address: int, *words: int) -> int:
        """The error code of a write that must be refused."""
        reply = self.send(write(address, *words))
        assert reply is not None and reply == refused(0x10, reply[2])
        return reply[2]

    def read(self, address: int, count: int = 1) -> list[int]:
        """Registers by a read that must succeed."""
        reply = self.send(read(address, count))
        assert (
            reply is not None
            and reply[:3] == bytes((UNIT, 0x03, 2 * count))
            and reply[-2:] == crc(reply[:-2])
        )
        return [int.from_bytes(reply[at : at + 2], "big") for at in range(3, 3 + 2 * count, 2)]

    def word(self, address: int) -> int:
        """One register."""
        return self.read(address)[0]
