"""The wire of one RS-485 line with its drives, as a pure model in time.

Bytes take their true time: what the master writes at once still crosses the wire character by
character, a request ends with 3.5 characters of silence (in ASCII with CR LF), the addressed drive answers
after its turnaround, and the master gets each byte of the reply no earlier than its last bit has passed.

In strict mode a request that follows other traffic without the mandatory silence is not a frame to any
drive. Two stations that talk at once destroy each other's frames in either mode. A drive listens before
it talks: a reply that is due while another one is on the wire waits for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from gateway.simulator.drive import Drive
from gateway.simulator.faults import delay, distorted
from gateway.simulator.wire import WireFrame, WireTiming

CHUNK = 0.001
"""Seconds of wire time whose bytes are handed over together, at the end of the last one."""
STEP = 0.05
"""Seconds between two looks at drives that nobody asks."""
STRANGER = "stranger"
"""Another master on the line, as the log calls it."""
LOG_LENGTH = 20_000
"""Frames that the log keeps."""


@dataclass(slots=True)
class _Incoming:
    """A frame that the master is sending."""

    start: float
    end: float
    data: bytearray
    note: str = ""


@dataclass(slots=True)
class _Reply:
    """A reply that waits for its moment, or a request of `STRANGER`."""

    start: float
    data: bytes
    drive: str


@dataclass(slots=True)
class _Overheard:
    """A stranger's request that ended at ``end``; the drives take it for a frame at ``at``."""

    at: float
    end: float
    data: bytes


class Line:
    """The wire and all its drives. Times are seconds of any clock that never falls.

    The caller says what the master wrote (`receive`), asks what the master has got by now (`advance`),
    and when to ask next (`due`).
    """

    def __init__(
        self, timing: WireTiming, drives: Iterable[Drive], *, strict: bool = True, echo: bool = False
    ) -> None:
        self.timing = timing
        self.strict = strict
        self.echo = echo
        self.log: deque[WireFrame] = deque(maxlen=LOG_LENGTH)
        self._drives: Sequence[Drive] = tuple(drives)
        self._incoming: _Incoming | None = None
        self._replies: list[_Reply] = []
        self._overheard: list[_Overheard] = []
        self._passing: deque[tuple[float, bytes]] = deque()
        self._arrived = bytearray()
        self._quiet_since = float("-inf")
        self._stepped_at = float("-inf")

    def receive(self, data: bytes, at: float) -> None:
        """The master wrote these bytes at ``at``."""
        self._run(at)
        if self._incoming is None:
            self._incoming = self._begin(at)
        incoming = self._incoming
        start = max(at, incoming.end)
        incoming.data += data
        incoming.end = start + len(data) * self.timing.character
        if self.echo:
            self._pass(data, start)

    def intrude(self, data: bytes, at: float) -> None:
        """Another master sends a request at ``at``, or once the line is free: the drives obey and answer it,
        and our own master hears everything."""
        self._run(at)
        self._replies.append(_Reply(at, data, STRANGER))
        self._replies.sort(key=lambda waiting: waiting.start)

    def advance(self, now: float) -> bytes:
        """What has reached the master since the last call."""
        self._run(now)
        if now >= self._stepped_at + STEP:
            self._step(now)
        arrived, self._arrived = bytes(self._arrived), bytearray()
        return arrived

    def _step(self, now: float) -> None:
        """Let time pass in the drives, that their state can be looked at from outside."""
        self._stepped_at = now
        for drive in self._drives:
            drive.step(now)

    def due(self) -> float:
        """When `advance` has something to do next; at the latest for a look at the drives."""
        return min([self._stepped_at + STEP, *(at for at, _ in self._events())])

    @property
    def ends_reply(self) -> bool:
        """What is due next may be the last byte that the master waits for: the one worth being exact for."""
        return len(self._passing) == 1

    def _events(self) -> list[tuple[float, Callable[[], None]]]:
        """What lies ahead: bytes that arrive, a request that ends, a reply that starts."""
        events: list[tuple[float, Callable[[], None]]] = []
        if self._passing:
            events.append((self._passing[0][0], self._deliver))
        if self._incoming is not None:
            events.append((self._incoming.end + self.timing.patience(self._incoming.data), self._hear))
        if self._replies:
            events.append((self._replies[0].start, self._speak))
        if self._overheard:
            events.append((self._overheard[0].at, self._overhear))
        return events

    def _run(self, now: float) -> None:
        """Let everything happen that is due by ``now``, in order."""
        while events := self._events():
            at, happen = min(events, key=lambda event: event[0])
            if at > now:
                return
            happen()

    def _begin(self, at: float) -> _Incoming:
        """The master starts a frame; a reply that is still on the wire is destroyed with it."""
        silence = at - self._quiet_since
        incoming = _Incoming(at, at, bytearray())
        if silence < 0:
            incoming.note = "collision"
            self.log[-1] = replace(self.log[-1], note="collision")
            self._passing = deque((due, garbled(data)) for due, data in self._passing)
        elif self.strict and silence < self.timing.silence - self.timing.tolerance:
            incoming.note = f"only {silence * 1000:.2f} ms of silence before it"
        return incoming

    def _deliver(self) -> None:
        self._arrived += self._passing.popleft()[1]

    def _hear(self) -> None:
        """Silence has ended the master's frame: every drive on the line gets it."""
        assert self._incoming is not None
        incoming, self._incoming = self._incoming, None
        data = bytes(incoming.data)
        self._quiet_since = max(self._quiet_since, incoming.end)
        self.log.append(WireFrame(incoming.start, incoming.end, ">>", data, note=incoming.note))
        for drive in self._drives:
            if drive.connected:
                self._offer(drive, data, incoming)

    def _offer(self, drive: Drive, data: bytes, incoming: _Incoming) -> None:
        now = incoming.end + self.timing.patience(data)
        if incoming.note:
            drive.disturbed()
        elif reply := drive.handle(data, now):
            self._queue(drive, reply, incoming.end)

    def _queue(self, drive: Drive, reply: bytes, request_end: float) -> None:
        fault = drive.faults.take()
        start = request_end + max(self.timing.silence, drive.turnaround) + delay(fault)
        if data := distorted(reply, fault):
            self._replies.append(_Reply(start, data, drive.name))
            self._replies.sort(key=lambda waiting: waiting.start)

    def _speak(self) -> None:
        """A reply goes on the wire, as soon as no other reply is there."""
        reply = self._replies.pop(0)
        if reply.start < self._quiet_since:
            self._replies.insert(0, _Reply(self._quiet_since + self.timing.silence, reply.data, reply.drive))
            self._replies.sort(key=lambda waiting: waiting.start)
            return
        self._send(reply)

    def _send(self, reply: _Reply) -> None:
        data, note = reply.data, ""
        if self._incoming is not None:
            self._incoming.note = note = "collision"
            data = garbled(data)
        end = self._pass(data, reply.start)
        self._quiet_since = end
        if reply.drive == STRANGER and not note:
            self._overheard.append(_Overheard(end + self.timing.patience(data), end, data))
        self.log.append(WireFrame(reply.start, end, "<<", data, reply.drive, note))

    def _overhear(self) -> None:
        """The drives make no difference between masters."""
        heard = self._overheard.pop(0)
        for drive in self._drives:
            if drive.connected and (answer := drive.handle(heard.data, heard.at)):
                self._queue(drive, answer, heard.end)

    def _pass(self, data: bytes, start: float) -> float:
        """Put bytes on their way to the master; the end of the last one."""
        character = self.timing.character
        size = max(1, int(CHUNK / character))
        for at in range(0, len(data), size):
            chunk = data[at : at + size]
            self._passing.append((start + (at + len(chunk)) * character, chunk))
        return start + len(data) * character


def garbled(data: bytes) -> bytes:
    """What is left of bytes that collided, or were sent at another speed."""
    return bytes(byte ^ 0x55 for byte in data)
