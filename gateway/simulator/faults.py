"""Faults of the wire as values: what happens to a drive's replies."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass


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


WireFault = DropReply | DelayReply | CorruptByte | NoiseBefore


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
    return data


def delay(fault: WireFault | None) -> float:
    """Seconds that the fault adds before the reply."""
    return fault.seconds if isinstance(fault, DelayReply) else 0.0
