"""A drive on the line: the Modbus server in front of a drive model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from gateway.mapping.profile import ErrorMeaning, ModbusFacts
from gateway.simulator import frame
from gateway.simulator.bank import Bank
from gateway.simulator.faults import FaultPlan
from gateway.simulator.frame import DamagedError, LineError, Request
from gateway.simulator.happening import Happening
from gateway.simulator.refusal import Reason, RefusalError, code_of
from gateway.simulator.state import DriveState


class Model(Protocol):
    """How one make of drive behaves. Methods with ``now`` are called with a time that never falls."""

    bank: Bank

    @property
    def state(self) -> DriveState:
        """The drive as it was at the last step."""
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

    def write(self, address: int, words: Sequence[int]) -> None:
        """Take registers over, all or none; raises `RefusalError`."""
        ...

    def refused(self, reason: Reason) -> None:
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
        self._functions: Mapping[int, Callable[[bytes], bytes]] = {
            0x03: self._read,
            0x10: self._write,
        }

    @property
    def state(self) -> DriveState:
        """The drive as it was at its last step."""
        return self.model.state

    @property
    def registers(self) -> Mapping[int, int]:
        """Raw register contents by wire address."""
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
            request = frame.unseal(adu)
            return self._serve(request, now) if request.unit == self.unit else None
        except DamagedError as damage:
            self.model.line_error(damage.error)
            return None

    def disturbed(self) -> None:
        """Something was on the line that is no frame."""
        self.model.line_error(LineError.CRC)

    def _serve(self, request: Request, now: float) -> bytes:
        self.model.step(now)
        reply = self._answer(request)
        self.model.heard(now)
        return reply

    def _answer(self, request: Request) -> bytes:
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
        return frame.read_reply(self.unit, self.model.bank.read(request.address, request.count))

    def _write(self, data: bytes) -> bytes:
        request = frame.parse_write(data)
        if not 1 <= request.count <= self._facts.write_max or request.byte_count != 2 * request.count:
            raise RefusalError("illegal_count")
        self.model.bank.require(request.address, request.count)
        self.model.write(request.address, request.words)
        return frame.write_reply(self.unit, request.address, request.count)
