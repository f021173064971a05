"""A drive on the line: the Modbus server in front of a drive's model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, Protocol

from gateway.mapping.profile import ErrorMeaning, ModbusFacts
from gateway.simulator import ascii as ascii_frames
from gateway.simulator import frame, rtu
from gateway.simulator.bank import Bank
from gateway.simulator.faults import FaultPlan
from gateway.simulator.frame import DamagedError, LineError, Request, WriteRequest
from gateway.simulator.happening import Happening
from gateway.simulator.refusal import RefusalError, code_of
from gateway.simulator.state import DriveState

BROADCAST = 0
"""The unit that means every drive."""


@dataclass(frozen=True, slots=True)
class Framing:
    """How requests and replies stand on the wire."""

    unseal: Callable[[bytes], Request]
    seal: Callable[[bytes], bytes]


FRAMINGS: Mapping[Literal["rtu", "ascii"], Framing] = MappingProxyType(
    {
        "rtu": Framing(rtu.unseal, rtu.seal),
        "ascii": Framing(ascii_frames.unseal, ascii_frames.seal),
    }
)


class Model(Protocol):
    """How a drive behaves. Methods with ``now`` are called with a time that never falls."""

    bank: Bank

    @property
    def state(self) -> DriveState:
        """The drive as it was at the last step."""
        ...

    @property
    def away(self) -> bool:
        """The drive restarts and hears nothing."""
        ...

    def step(self, now: float) -> None:
        """Let time pass up to ``now``."""
        ...

    def heard(self, now: float) -> None:
        """A sound request for this drive has arrived."""
        ...

    def line_error(self, error: LineError) -> None:
        """A damaged frame was on the line."""
        ...

    def write(self, address: int, words: Sequence[int]) -> bool:
        """Take registers over, all or none; False: without a reply. Raises `RefusalError`."""
        ...

    def broadcast(self, request: Request) -> None:
        """Obey a request to all drives, or ignore it."""
        ...

    def refused(self, reason: str) -> None:
        """A request was refused: drives that keep a record of it may do so."""
        ...

    def post(self, happening: Happening) -> None:
        """Something happens at the drive itself at its next step; callable from any thread."""
        ...


class Drive:
    """A model at a unit address. Everything but `step` and `handle` may be used from any thread.

    ``turnaround`` is in seconds from the end of a request to the start of the reply; a drive that is
    not ``connected`` neither hears nor answers; ``faults`` are what its replies suffer on the wire.
    """

    def __init__(
        self,
        name: str,
        unit: int,
        model: Model,
        *,
        facts: ModbusFacts,
        errors: Mapping[int, ErrorMeaning],
        framing: Framing = FRAMINGS["rtu"],
        turnaround: float = 0.005,
    ) -> None:
        self.name = name
        self.unit = unit
        self.model = model
        self.turnaround = turnaround
        self.connected = True
        self.faults = FaultPlan()
        self._facts = facts
        self._errors = errors
        self._framing = framing
        self._functions: Mapping[int, Callable[[bytes], bytes | None]] = {
            0x03: self._read,
            0x06: self._write_one,
            0x08: self._loop_back,
            0x10: self._write,
        }

    @property
    def state(self) -> DriveState:
        """The drive as it was at its last step."""
        return self.model.state

    @property
    def registers(self) -> Mapping[int, int]:
        """Raw register contents by wire address, as reading shows them."""
        return self.model.bank.words

    def post(self, happening: Happening) -> None:
        """Let something happen at the drive itself (a fault, a hand on the panel) at its next step."""
        self.model.post(happening)

    def step(self, now: float) -> None:
        """Let time pass up to ``now``, in seconds of any clock that never falls."""
        self.model.step(now)

    def handle(self, adu: bytes, now: float) -> bytes | None:
        """The reply to a frame whose end was recognised at ``now``; None: silence."""
        try:
            request = self._framing.unseal(adu)
            content = self._serve(request, now) if request.unit in (self.unit, BROADCAST) else None
        except DamagedError as damage:
            self.model.line_error(damage.error)
            return None
        return self._framing.seal(content) if content is not None else None

    def disturbed(self) -> None:
        """Something was on the line that is no frame."""
        self.model.line_error(LineError.CRC)

    def _serve(self, request: Request, now: float) -> bytes | None:
        self.model.step(now)
        if self.model.away:
            return None
        if request.unit == BROADCAST:
            self.model.broadcast(request)
            return None
        reply = self._answer(request)
        self.model.heard(now)
        return reply

    def _answer(self, request: Request) -> bytes | None:
        handler = self._functions.get(request.function)
        try:
            if handler is None or request.function not in self._facts.functions:
                raise RefusalError("illegal_function")
            return handler(request.data)
        except RefusalError as refusal:
            self.model.refused(refusal.reason)
            return frame.error_reply(self.unit, request.function, code_of(refusal.reason, self._errors))

    def _read(self, data: bytes) -> bytes:
        request = frame.parse_read(data)
        if not 1 <= request.count <= self._facts.read_max:
            raise RefusalError("illegal_count")
        words = self.model.bank.read(request.address, request.count, bridge=self._facts.bridge)
        return frame.read_reply(self.unit, words)

    def _write_one(self, data: bytes) -> bytes | None:
        return frame.echo(self.unit, 0x06, data) if self._store(frame.parse_write_one(data)) else None

    def _write(self, data: bytes) -> bytes | None:
        request = frame.parse_write(data)
        if not 1 <= request.count <= self._facts.write_max or request.byte_count != 2 * request.count:
            raise RefusalError("illegal_count")
        answered = self._store(request)
        return frame.write_reply(self.unit, request.address, request.count) if answered else None

    def _store(self, request: WriteRequest) -> bool:
        """Write; False when the drive does not answer it."""
        self.model.bank.require_writable(request.address, request.count)
        return self.model.write(request.address, request.words)

    def _loop_back(self, data: bytes) -> bytes:
        """Whatever data comes goes back; only sub-function 0 is known."""
        if frame.parse_loop_back(data) != 0:
            raise RefusalError("illegal_function")
        return frame.echo(self.unit, 0x08, data)
