"""A good reply is found wherever it stands in the stream, and nothing else is taken for it."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.modbus import pdu
from gateway.modbus.framing import Framing, Seeker, framing_of
from gateway.modbus.pdu import Reply, Request

UNIT = 5
NAMES = ["rtu", "ascii"]
REQUESTS = [
    pdu.read_registers(0x20, 5),
    pdu.write_registers(1, [1, 6000]),
    pdu.write_register(2, 3000),
    pdu.loop_back(0xA537),
]


def reply_to(request: Request) -> bytes:
    """The PDU of a normal reply."""
    return request.head + bytes(range(request.reply_length - len(request.head)))


def meaning(request: Request) -> Reply:
    return Reply((0x0001, 0x0203, 0x0405, 0x0607, 0x0809) if request.function == 3 else ())


def cut(data: bytes, cuts: list[int]) -> list[bytes]:
    edges = sorted({0, len(data), *(c % (len(data) + 1) for c in cuts)})
    return [data[a:b] for a, b in pairwise(edges)]


def feed(seeker: Seeker, pieces: list[bytes]) -> Reply | None:
    for piece in pieces:
        if (reply := seeker.feed(piece)) is not None:
            return reply
    return None


def start(name: str, request: Request, echo: bool = False) -> tuple[Framing, Seeker, bytes]:
    framing = framing_of(name)
    sent = framing.encode(UNIT, request.pdu)
    return framing, framing.seeker(sent, request, echo), sent


requests = st.sampled_from(REQUESTS)
names = st.sampled_from(NAMES)
cuts = st.lists(st.integers(0, 300), max_size=8)


@given(names, requests, cuts)
def test_any_split(name: str, request: Request, at: list[int]) -> None:
    framing, seeker, _ = start(name, request)
    assert feed(seeker, cut(framing.encode(UNIT, reply_to(request)), at)) == meaning(request)


@given(names, requests, cuts, st.integers(0, 255))
def test_exceptions(name: str, request: Request, at: list[int], code: int) -> None:
    framing, seeker, _ = start(name, request)
    frame = framing.encode(UNIT, bytes((request.function | 0x80, code)))
    assert feed(seeker, cut(frame, at)) == Reply(exception=code)


@given(requests, cuts, st.binary(max_size=40))
def test_rtu_behind_noise(request: Request, at: list[int], noise: bytes) -> None:
    framing, seeker, _ = start("rtu", request)
    stream = noise + framing.encode(UNIT, reply_to(request))
    assert feed(seeker, cut(stream, at)) == meaning(request)


@given(requests, cuts, st.binary(max_size=40))
def test_ascii_behind_noise(request: Request, at: list[int], noise: bytes) -> None:
    framing, seeker, _ = start("ascii", request)
    stream = noise + framing.encode(UNIT, reply_to(request))
    assert feed(seeker, cut(stream, at)) == meaning(request)


@given(names, requests, cuts, st.integers(1, 247).filter(lambda unit: unit != UNIT))
def test_behind_a_strangers_frame(name: str, request: Request, at: list[int], stranger: int) -> None:
    framing, seeker, _ = start(name, request)
    pdus = reply_to(request)
    stream = framing.encode(stranger, pdus) + framing.encode(UNIT, pdus)
    assert feed(seeker, [framing.encode(stranger, pdus)]) is None
    _, seeker, _ = start(name, request)
    assert feed(seeker, cut(stream, at)) == meaning(request)


@given(names, requests, cuts)
def test_behind_the_expected_echo(name: str, request: Request, at: list[int]) -> None:
    framing, seeker, sent = start(name, request, echo=True)
    assert feed(seeker, cut(sent, at)) is None, "an echo is never a reply"
    assert feed(seeker, cut(framing.encode(UNIT, reply_to(request)), at)) == meaning(request)
    assert seeker.echoed


@given(names, cuts)
def test_unexpected_echo_is_passed_and_noticed(name: str, at: list[int]) -> None:
    request = REQUESTS[0]
    framing, seeker, sent = start(name, request)
    stream = sent + framing.encode(UNIT, reply_to(request))
    assert feed(seeker, cut(stream, at)) == meaning(request)
    assert seeker.echoed


@given(names, requests, st.integers(0, 1000), st.integers(0, 7))
def test_one_flipped_bit_is_never_a_reply(name: str, request: Request, where: int, bit: int) -> None:
    framing, seeker, _ = start(name, request)
    frame = bytearray(framing.encode(UNIT, reply_to(request)))
    frame[where % len(frame)] ^= 1 << bit
    reply = seeker.feed(bytes(frame))
    if name == "ascii" and bytes(frame).upper() == framing.encode(UNIT, reply_to(request)):
        assert reply == meaning(request)  # a small hexadecimal digit says the same
    else:
        assert reply is None


@given(names, requests)
def test_damaged_frame_does_not_hide_the_good_one(name: str, request: Request) -> None:
    framing, seeker, _ = start(name, request)
    frame = framing.encode(UNIT, reply_to(request))
    assert seeker.feed(frame[:-3] + frame) == meaning(request)


def test_only_what_stands_at_the_end_is_a_reply() -> None:
    request = REQUESTS[0]
    framing, seeker, _ = start("rtu", request)
    late, reply = framing.encode(UNIT, bytes((0x83, 2))), framing.encode(UNIT, reply_to(request))
    assert seeker.feed(late + reply) == meaning(request)
    assert seeker.length == len(reply)
    assert seeker.feed(b"\x00") is None
    assert seeker.feed(late) == Reply(exception=2)


@given(st.sampled_from(["rtu", "ascii", "tcp"]), requests, st.binary(max_size=300), cuts)
def test_noise_alone_neither_crashes_nor_answers(
    name: str, request: Request, noise: bytes, at: list[int]
) -> None:
    _, seeker, _ = start(name, request)
    assert feed(seeker, cut(noise, at)) is None


@given(requests, cuts)
def test_tcp(request: Request, at: list[int]) -> None:
    framing, seeker, sent = start("tcp", request)
    header = sent[:4] + (1 + request.reply_length).to_bytes(2, "big") + sent[6:7]
    stream = header + reply_to(request)
    assert feed(seeker, cut(stream, at)) == meaning(request)
    assert framing.numbered


def test_tcp_ignores_replies_with_other_numbers() -> None:
    request = REQUESTS[0]
    framing = framing_of("tcp")
    first = framing.encode(UNIT, request.pdu)
    second = framing.encode(UNIT, request.pdu)
    assert first[:2] != second[:2]
    body = (1 + request.reply_length).to_bytes(2, "big") + bytes((UNIT,)) + reply_to(request)
    seeker = framing.seeker(second, request)
    assert seeker.feed(first[:4] + body) is None
    assert seeker.feed(second[:4] + body) == meaning(request)


@pytest.mark.parametrize(("name", "size"), [("rtu", 8), ("ascii", 17), ("tcp", 12)])
def test_size_is_what_encode_makes(name: str, size: int) -> None:
    framing = framing_of(name)
    assert framing.size(5) == size == len(framing.encode(1, REQUESTS[0].pdu))


def test_a_reply_is_told_once() -> None:
    """What comes after it is looked at for itself: else one reply would count as several."""
    request = REQUESTS[0]
    framing, seeker, _ = start("ascii", request)
    assert seeker.feed(framing.encode(UNIT, reply_to(request))) == meaning(request)
    assert seeker.feed(b":06") is None


def test_what_is_as_long_as_a_request_is_no_spoilt_reply() -> None:
    """A reply with a byte doubled could be what another master asks, with a bit wrong."""
    framing, seeker, _ = start("rtu", pdu.read_registers(0x28, 1))
    reply = framing.encode(UNIT, b"\x03\x02\x12\x34")
    seeker.feed(reply[:3] + reply[3:4] + reply[3:])
    assert not seeker.spoilt
    _, seeker, _ = start("rtu", pdu.read_registers(0x28, 1))
    seeker.feed(reply[:3] + b"\xff" + reply[4:])
    assert seeker.spoilt
