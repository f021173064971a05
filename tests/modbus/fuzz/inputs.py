"""Streams that a line may bring after a request: frames, damaged, cut, doubled, mixed with others."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

from gateway.modbus import pdu
from gateway.modbus.framing import FramingName, framing_of
from gateway.modbus.pdu import Request

UNIT = 5
REQUESTS = (
    pdu.read_registers(0x20, 1),
    pdu.read_registers(0x20, 5),
    pdu.read_registers(0, 125),
    pdu.write_registers(1, [1, 6000]),
    pdu.write_register(2, 3000),
    pdu.loop_back(0xA537),
)
KEPT = 400
"""Streams that are kept to make others of."""


@dataclass(slots=True)
class Case:
    """A request, what came after it, in which pieces, and whether an echo was to be expected."""

    request: Request
    sent: bytes
    stream: bytes
    pieces: list[bytes]
    echo: bool


class Inputs:
    """An endless source of cases. `keep` those that made something new happen: others are made of them."""

    def __init__(self, name: FramingName, seed: int) -> None:
        self._chance = random.Random(f"{name} {seed}")
        self._framing = framing_of(name)
        self._kept: list[bytes] = []
        self._mutators: tuple[Callable[[bytes], bytes], ...] = (
            self._flip,
            self._overwrite,
            self._drop,
            self._insert,
            self._double,
            self._splice,
            lambda data: data[: self._at(data)],
            lambda data: data[self._at(data) :],
        )

    def __iter__(self) -> Iterator[Case]:
        chance = self._chance
        while True:
            request = chance.choice(REQUESTS)
            sent = self._framing.encode(UNIT, request.pdu)
            stream = self._base(request, sent)
            for _ in range(chance.choice((0, 1, 1, 2, 4, 8))):
                stream = chance.choice(self._mutators)(stream)
            stream = stream[:1200]
            yield Case(request, sent, stream, self._cut(stream), chance.random() < 0.3)

    def keep(self, case: Case) -> None:
        """Make others of this one."""
        if len(self._kept) < KEPT:
            self._kept.append(case.stream)
        else:
            self._kept[self._chance.randrange(KEPT)] = case.stream

    def reply(self, request: Request) -> bytes:
        """A normal reply's PDU."""
        return request.head + self._chance.randbytes(request.reply_length - len(request.head))

    def _base(self, request: Request, sent: bytes) -> bytes:
        chance = self._chance
        kinds = (
            lambda: self._answer(sent, UNIT, self.reply(request)),
            lambda: self._answer(sent, UNIT, bytes((request.function | 0x80, chance.randrange(256)))),
            lambda: self._answer(sent, chance.randrange(256), self.reply(request)),
            lambda: self._framing.encode(UNIT, self.reply(chance.choice(REQUESTS))),
            lambda: self._framing.encode(chance.randrange(256), chance.choice(REQUESTS).pdu),
            lambda: sent,
            lambda: chance.choice(self._kept) if self._kept else b"",
            lambda: chance.randbytes(chance.randrange(60)),
        )
        return b"".join(chance.choice(kinds)() for _ in range(chance.choice((1, 1, 2, 3))))

    def _answer(self, sent: bytes, unit: int, reply: bytes) -> bytes:
        frame = self._framing.encode(unit, reply)
        return sent[:2] + frame[2:] if self._framing.numbered else frame

    def _at(self, data: bytes) -> int:
        return self._chance.randrange(len(data) + 1)

    def _flip(self, data: bytes) -> bytes:
        if not data:
            return data
        at = self._chance.randrange(len(data))
        return data[:at] + bytes((data[at] ^ 1 << self._chance.randrange(8),)) + data[at + 1 :]

    def _overwrite(self, data: bytes) -> bytes:
        at = self._at(data)
        return data[:at] + self._chance.choice((b"\0", b"\xff", b":", b"\r\n", b"\x83")) + data[at + 1 :]

    def _drop(self, data: bytes) -> bytes:
        at = self._at(data)
        return data[:at] + data[at + self._chance.randrange(1, 4) :]

    def _insert(self, data: bytes) -> bytes:
        at = self._at(data)
        return data[:at] + self._chance.randbytes(self._chance.randrange(1, 6)) + data[at:]

    def _double(self, data: bytes) -> bytes:
        first, last = sorted((self._at(data), self._at(data)))
        return data[:last] + data[first:]

    def _splice(self, data: bytes) -> bytes:
        other = self._chance.choice(self._kept) if self._kept else data
        return data[: self._at(data)] + other[self._at(other) :]

    def _cut(self, data: bytes) -> list[bytes]:
        edges = sorted({0, len(data), *(self._at(data) for _ in range(self._chance.randrange(6)))})
        return [data[first:last] for first, last in pairwise(edges)]
