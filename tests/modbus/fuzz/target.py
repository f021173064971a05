"""One case against a framing: nothing escapes, and only a frame is taken for a reply."""

from __future__ import annotations

from collections.abc import Hashable

from gateway.modbus.framing import FramingName, framing_of
from gateway.modbus.overheard import overheard
from gateway.modbus.pdu import Reply, Request
from tests.modbus.fuzz.inputs import UNIT, Case, Inputs
from tests.modbus.fuzz.oracle import CHECKS, tcp_frames

READS = (3, 4)


def judge(name: FramingName, case: Case) -> Hashable:
    """Try one case; what it made happen, in a few words. Raises `AssertionError`, or whatever escaped."""
    framing = framing_of(name)
    whole = framing.seeker(case.sent, case.request, case.echo)
    reply = whole.feed(case.stream)
    if reply is not None:
        _must_be_one(name, case, reply, case.stream[len(case.stream) - whole.length :])
    pieces = framing.seeker(case.sent, case.request, case.echo)
    last = None
    for piece in case.pieces:
        last = pieces.feed(piece)
        assert 0 <= pieces.patience <= 1
    if name != "tcp":  # whose stream says where frames end; the reply is told once, when it is whole
        assert (last, pieces.heard) == (reply if case.pieces else None, case.stream)
        _must_be_found(name, case)
    asked = [(unit, frame, end) for unit, frame, end in framing.requests(case.stream)]
    assert all(0 < end <= len(case.stream) and 0 <= unit <= 255 for unit, _, end in asked)
    heard = overheard(name, case.stream)
    intact = framing.intact(case.stream)
    assert not intact or CHECKS[name](case.stream) is not None or name == "ascii"
    kind = None if reply is None else (reply.exception is None, whole.length)
    return kind, whole.echoed, whole.spoilt, len(asked), intact, len(str(heard)) // 40


def _must_be_one(name: FramingName, case: Case, reply: Reply, data: bytes) -> None:
    """By what the standards say, the bytes that were taken for the reply are one."""
    if name == "tcp":
        assert any(
            frame.unit == UNIT and _says(case.request, frame.pdu) == reply
            for number, frame in tcp_frames(case.stream)
            if number == case.sent[:2]
        ), "no frame that says so"
        return
    frame = CHECKS[name](data)
    assert frame is not None, "no frame"
    assert frame.unit == UNIT, "another unit's"
    assert _says(case.request, frame.pdu) == reply, "not what it says"


def _says(request: Request, pdu: bytes) -> Reply | None:
    function = request.pdu[0]
    if len(pdu) == 2 and pdu[0] == function | 0x80:
        return Reply(exception=pdu[1])
    if function not in READS:
        return Reply() if pdu[:1] == request.pdu[:1] and pdu[1:5] == request.pdu[1:5] else None
    count = int.from_bytes(request.pdu[3:5], "big")
    if pdu[:2] != bytes((function, 2 * count)) or len(pdu) != 2 + 2 * count:
        return None
    return Reply(tuple(int.from_bytes(pdu[at : at + 2], "big") for at in range(2, len(pdu), 2)))


def _must_be_found(name: FramingName, case: Case) -> None:
    """Whatever came before: a good reply at the end is the reply, where no echo is expected."""
    framing = framing_of(name)
    good = framing.encode(UNIT, case.request.head + bytes(case.request.reply_length - len(case.request.head)))
    if case.request.mirrored:  # the first copy may be our own echo
        good = good + good
    seeker = framing.seeker(case.sent, case.request, case.echo)
    seeker.feed(case.stream)
    assert seeker.feed(good) is not None, "a good reply was not found"


def fuzz(name: FramingName, number: int, seed: int) -> set[Hashable]:
    """Try so many cases; all that they made happen. Raises with the case that failed."""
    inputs = Inputs(name, seed)
    seen: set[Hashable] = set()
    for case, _ in zip(inputs, range(number), strict=False):
        try:
            what = judge(name, case)
        except Exception as error:
            raise AssertionError(
                f"{name}, seed {seed}: {error or type(error).__name__}; sent {case.sent.hex(' ')}, "
                f"echo {case.echo}, heard {[piece.hex(' ') for piece in case.pieces]}"
            ) from error
        if what not in seen:
            seen.add(what)
            inputs.keep(case)
    return seen
