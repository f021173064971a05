"""Faults of the wire as values: what happens to a drive's replies."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

ALIKE = 3
"""Bytes with which two replies to one request begin alike: unit, function, number of bytes."""


@dataclass(frozen=True, slots=True)
class DropReply:
    """The drive acts, but its reply never comes."""


@dataclass(frozen=True, slots=True)
class DelayReply:
    """The reply starts so many seconds later than usual."""

    seconds: float


@dataclass(frozen=True, slots=True)
class CorruptByte:
    """Bits of one byte of the reply are turned; ``index`` may count from the end."""

    index: int = -1
    mask: int = 0xFF


@dataclass(frozen=True, slots=True)
class NoiseBefore:
    """Stray bytes directly before the reply."""

    data: bytes


@dataclass(frozen=True, slots=True)
class OtherSpeed:
    """The reply is sent at another speed: the master gets other bytes, and not as many."""


@dataclass(frozen=True, slots=True)
class Collision:
    """A second drive with the same address talks at once: the replies begin alike, and where they differ the
    wire carries neither."""


WireFault = DropReply | DelayReply | CorruptByte | NoiseBefore | OtherSpeed | Collision


class FaultPlan:
    """The faults that the next replies of one drive suffer, in order. May be used from any thread."""

    def __init__(self) -> None:
        self._queue: deque[WireFault] = deque()
        self._lasting: WireFault | None = None

    def inject(self, fault: WireFault, times: int | None = 1) -> None:
        """Let the next ``times`` replies suffer ``fault``; None: every reply until `clear`."""
        if times is None:
            self._lasting = fault
        else:
            self._queue.extend([fault] * times)

    def mute(self) -> None:
        """No reply any more, until `clear`."""
        self.inject(DropReply(), times=None)

    def clear(self) -> None:
        """Back to health."""
        self._queue.clear()
        self._lasting = None

    def take(self) -> WireFault | None:
        """The fault of the reply that is about to go."""
        try:
            return self._queue.popleft()
        except IndexError:
            return self._lasting


def distorted(data: bytes, fault: WireFault | None) -> bytes:
    """The reply as the fault leaves it on the wire."""
    match fault:
        case DropReply():
            return b""
        case CorruptByte(index, mask):
            index %= len(data)
            return data[:index] + bytes((data[index] ^ mask,)) + data[index + 1 :]
        case NoiseBefore(noise):
            return noise + data
        case OtherSpeed():
            return bytes((byte * 37 + 11 * at) & 0xFF for at, byte in enumerate(data[: 2 * len(data) // 3]))
        case Collision():
            return data[:ALIKE] + bytes(byte & 0x5A for byte in data[ALIKE:]) + b"\xfe"
    return data


def delay(fault: WireFault | None) -> float:
    """Seconds that the fault adds before the reply."""
    return fault.seconds if isinstance(fault, DelayReply) else 0.0
