"""A drive with the registers of a 7200GS: holes refuse, some values move, writes are kept."""

from __future__ import annotations

from benchmarks.wire.frames import READ, Request, checked

READABLE = (
    (0x01, 0x02),
    (0x09, 0x09),
    (0x20, 0x24),
    (0x27, 0x2D),
    (0x31, 0x33),
    (0x3D, 0x40),
    (0x100, 0x5FF),
)
"""Closed ranges of addresses that there are; a read across anything else is refused."""
MOVING = frozenset((0x23, 0x24, 0x27, 0x28, 0x29, 0x2A, 0x2B, 0x31, 0x32))
"""Measurements, which are different each time."""
LONGEST = 16
COMMAND, STATUS = 0x01, 0x20
SOURCES = 0x107
"""Sn-08: with zero the drive obeys the line."""
RUNNING, READY = 0x01, 0x04
BAD_FUNCTION, BAD_ADDRESS, BAD_COUNT = 1, 2, 3


class Drive:
    """One drive. Its registers hold values that depend on their address."""

    def __init__(self, unit: int) -> None:
        self.unit = unit
        self._words = {SOURCES: 0}
        self._reads = 0

    def reply(self, request: Request) -> bytes:
        """The frame that it answers with."""
        if not 1 <= request.count <= LONGEST:
            return self._refusal(request, BAD_COUNT)
        last = request.address + request.count - 1
        if not any(low <= request.address and last <= high for low, high in READABLE):
            return self._refusal(request, BAD_ADDRESS)
        return self._read(request) if request.function == READ else self._write(request)

    def _read(self, request: Request) -> bytes:
        self._reads += 1
        words = [self._word(request.address + offset) for offset in range(request.count)]
        data = b"".join(word.to_bytes(2, "big") for word in words)
        return checked(bytes((self.unit, READ, len(data))) + data)

    def _word(self, address: int) -> int:
        if address == STATUS:
            return READY | (self._words.get(COMMAND, 0) & RUNNING)
        moved = self._reads if address in MOVING else 0
        return self._words.get(address, (37 * address + moved) % 4000 if address >= STATUS else 0)

    def _write(self, request: Request) -> bytes:
        words = request.words or ()
        if len(words) != request.count:
            return self._refusal(request, BAD_COUNT)
        self._words.update(enumerate(words, request.address))
        head = bytes((self.unit, request.function))
        return checked(head + request.address.to_bytes(2, "big") + request.count.to_bytes(2, "big"))

    def _refusal(self, request: Request, code: int) -> bytes:
        return checked(bytes((self.unit, request.function | 0x80, code)))
