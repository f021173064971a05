"""Requests and what a reply must look like to be theirs.

pymodbus' PDU classes make and read the bytes. Whether a reply belongs to a request is decided here: RTU has
no transaction number, so everything that a reply echoes (function, byte count, address, quantity, value) is
compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.diag_message import ReturnQueryDataRequest
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadHoldingRegistersResponse,
    ReadInputRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

READ_HOLDING = 0x03
READ_INPUT = 0x04
WRITE_ONE = 0x06
DIAGNOSTICS = 0x08
WRITE_MANY = 0x10

EXCEPTION = 0x80
"""Added to the function code in an exception reply (application protocol V1.1b3, section 7)."""
EXCEPTION_LENGTH = 2
"""Bytes of an exception reply's PDU: function and code."""

READ_LIMIT = 125
WRITE_LIMIT = 123
READS = 4096
"""Requests to read that are kept: the same ones are asked again and again."""
_ADDRESSES = 0x10000

Shape = tuple[bytes, int]
"""The bytes that a normal reply begins with, and its length."""


@dataclass(frozen=True, slots=True)
class Request:
    """A request PDU, the bytes that its normal reply begins with, and that reply's length in bytes.

    ``error_functions`` are function bytes by which this unit reports an error, beside function + 80H.
    Two requests whose ``shape`` is the same have replies that nothing tells apart.
    """

    pdu: bytes
    head: bytes
    reply_length: int
    error_functions: tuple[int, ...] = ()

    @property
    def function(self) -> int:
        """The function code."""
        return self.pdu[0]

    @property
    def reads(self) -> bool:
        """True when registers are asked for."""
        return self.function in (READ_HOLDING, READ_INPUT)

    @property
    def exceptions(self) -> tuple[int, ...]:
        """Function bytes of the exception replies to it."""
        return (self.function | EXCEPTION, *self.error_functions)

    @property
    def shape(self) -> Shape:
        """What can be known of the normal reply beforehand."""
        return self.head, self.reply_length

    @property
    def mirrored(self) -> bool:
        """True when the normal reply is the request once more, so that an echo looks like it."""
        return self.head == self.pdu


@dataclass(frozen=True, slots=True)
class Reply:
    """What a unit said: the registers read (none for other requests), or the number of an exception."""

    words: tuple[int, ...] = ()
    exception: int | None = None


@lru_cache(READS)
def read_registers(address: int, count: int, function: int = READ_HOLDING) -> Request:
    """Read ``count`` registers from ``address``: holding (03H) or input (04H)."""
    _check_block(address, count, READ_LIMIT)
    make = {READ_HOLDING: ReadHoldingRegistersRequest, READ_INPUT: ReadInputRegistersRequest}[function]
    pdu = _bytes(make(address=address, count=count))
    return Request(pdu, *read_shape(count, function))


def write_register(address: int, word: int) -> Request:
    """Write one register with 06H; the reply echoes the request."""
    _check_block(address, 1, 1)
    _check_words((word,))
    return _echoed(_bytes(WriteSingleRegisterRequest(address=address, registers=[word])))


def write_registers(address: int, words: Sequence[int]) -> Request:
    """Write registers from ``address`` on with 10H; the reply echoes address and quantity."""
    _check_block(address, len(words), WRITE_LIMIT)
    _check_words(words)
    pdu = _bytes(WriteMultipleRegistersRequest(address=address, registers=list(words)))
    return Request(pdu, pdu[:5], 5)


def loop_back(nonce: int) -> Request:
    """Return query data (08H, sub-function 0): the reply echoes the 16-bit ``nonce``."""
    _check_words((nonce,))
    return _echoed(_bytes(ReturnQueryDataRequest(message=nonce)))


def read_shape(count: int, function: int = READ_HOLDING) -> Shape:
    """The shape of every read of so many registers."""
    return bytes((function, 2 * count)), 2 + 2 * count


def request_length(pdu: bytes) -> int:
    """How many bytes a request PDU that begins so has; 0 when that is no request that is known here."""
    function = pdu[0]
    if function in (READ_HOLDING, READ_INPUT, WRITE_ONE, DIAGNOSTICS):
        return 5
    return 6 + pdu[5] if function == WRITE_MANY and len(pdu) > 5 else 0


def overheard(pdu: bytes) -> Request | None:
    """The request that another master's whole PDU is; None when it is none that makes sense."""
    function, number = pdu[0], int.from_bytes(pdu[3:5], "big")
    if function in (READ_HOLDING, READ_INPUT):
        return Request(pdu, *read_shape(number, function)) if 1 <= number <= READ_LIMIT else None
    return Request(pdu, pdu[:5], 5) if function in (WRITE_ONE, DIAGNOSTICS, WRITE_MANY) else None


def interpret(request: Request, pdu: bytes) -> Reply | None:
    """What ``pdu`` says in reply to ``request``; None when it is not a reply to it.

    Exception codes are passed on as numbers, known or not: drives have codes of their own.
    """
    if len(pdu) == EXCEPTION_LENGTH and pdu[0] in request.exceptions:
        return Reply(exception=pdu[1])
    if len(pdu) != request.reply_length or not pdu.startswith(request.head):
        return None
    return Reply(_words(pdu) if request.function in (READ_HOLDING, READ_INPUT) else ())


def _words(pdu: bytes) -> tuple[int, ...]:
    response = ReadHoldingRegistersResponse()
    response.decode(pdu[1:])
    return tuple(response.registers)


def _bytes(pdu: ModbusPDU) -> bytes:
    return bytes((pdu.function_code,)) + pdu.encode()


def _echoed(pdu: bytes) -> Request:
    return Request(pdu, pdu, len(pdu))


def _check_block(address: int, count: int, limit: int) -> None:
    if not 1 <= count <= limit:
        raise ValueError(f"{count} registers in one request; Modbus allows 1 to {limit}")
    if not 0 <= address <= _ADDRESSES - count:
        raise ValueError(f"registers {address}..{address + count - 1} are not within 0..{_ADDRESSES - 1}")


def _check_words(words: Sequence[int]) -> None:
    if any(not 0 <= word <= 0xFFFF for word in words):
        raise ValueError("a register holds 0..65535")
