"""What became of a write, in words for people, the drive's own included. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gateway.core.drive import Drive
from gateway.core.guard import Ended
from gateway.core.meaning import Meaningless, meaning_of
from gateway.core.procedure import Finished
from gateway.core.store import Store
from gateway.core.wear import register_of, wearing
from gateway.line.interface import Answered, Refused, Silent, Unsent, Write
from gateway.modbus.encoding import decode, insert, to_words
from gateway.tag import Cause, Value, Verdict

UNSENT = {
    "expired": "its time to live ended before it could be sent",
    "not_admitted": "the drive's state changed before it could be sent",
    "line_down": "the line is down",
}


def explain(drive: Drive, finished: Finished) -> str:
    """A result in words, the drive's own included."""
    match finished.result:
        case Unsent(why):
            return UNSENT[why]
        case Refused(code):
            return in_words(drive, code)
        case Silent(doubted=True, code=code):
            said = "the drive answered" if code is None else in_words(drive, code)
            return f"{said} (perhaps to an earlier request, whose answer had not come)"
        case Silent(damaged):
            return "the drive's answer was damaged" if damaged else "the drive did not answer"
        case Answered():
            return "the drive answered"


def in_words(drive: Drive, code: int) -> str:
    """``the drive answered 22H locked: Sn and Cn while running``."""
    meaning = drive.profile.errors.get(code)
    if meaning is None:
        return f"the drive answered error {code:02X}H, which its document does not list"
    return f"the drive answered {code:02X}H {meaning.name}" + (f": {meaning.help}" if meaning.help else "")


def ended(drive: Drive, finished: Finished, before: str = "") -> Ended:
    """The end of a write whose frame was not sent, not answered or refused."""
    reason = before + explain(drive, finished)
    match finished.result:
        case Unsent("not_admitted") if (told := finished.objection) is not None:
            return Ended(told.verdict, told.cause, before + told.reason)
        case Unsent("expired"):
            return Ended(Verdict.EXPIRED, Cause.EXPIRED, reason)
        case Unsent("not_admitted"):
            return Ended(Verdict.REFUSED, Cause.PRECONDITION, reason)
        case Unsent():
            return Ended(Verdict.FAILED, Cause.LINE_DOWN, reason)
        case Refused(code):
            meaning = drive.profile.errors.get(code)
            return Ended(
                Verdict.REFUSED, Cause.DRIVE_REFUSED, reason, code, meaning.name if meaning else None
            )
        case _:
            return Ended(Verdict.FAILED, Cause.NO_ANSWER, reason)


def intent(drive: Drive, store: Store, request: Write, raws: Mapping[str, int]) -> dict[str, Any]:
    """R1: what the journal is told of a frame that is about to be sent: the registers, and of each point
    the value last seen (null where none is known) and the new one."""
    worn = sorted({register_of(point) for point in wearing(drive, raws)})
    return {
        "line": drive.line,
        "drive": drive.name,
        "unit": request.unit,
        "address": f"{request.address:04X}H",
        "words": [f"{word:04X}H" for word in request.words],
        "old": {name: _seen(drive, store, name) for name in raws},
        "new": {name: _meant(drive, store, name, raw) for name, raw in raws.items()},
        **({"wears": worn} if worn else {}),
    }


def _seen(drive: Drive, store: Store, name: str) -> Value:
    held = store.get(drive.tag(name))
    return held.sample.value if held else None


def _meant(drive: Drive, store: Store, name: str, raw: int) -> Value:
    """A raw value as it is understood now."""
    point = drive.profile.points[name]
    meaning = meaning_of(drive, store, point)
    if isinstance(meaning, Meaningless):
        return raw
    encoding = meaning.encoding
    words = (insert(encoding, raw, 0),) if encoding.width else to_words(encoding, raw)
    return decode(encoding, words, meaning.times).value
