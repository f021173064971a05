"""What became of a write, in words for people, the drive's own included. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gateway.core.drive import Drive
from gateway.core.guard import Ended
from gateway.core.procedure import (
    Ask,
    Finished,
)
from gateway.line.interface import Answered, Refused, Silent, Unsent
from gateway.tag import Cause, Verdict

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


def intent(ask: Ask, address: int, words: Sequence[int]) -> dict[str, Any]:
    """The journal's record of a frame that is about to be sent."""
    return {
        "kind": "intent",
        "ask": ask.number,
        "what": ask.what,
        "wanted": ask.wanted,
        "by": ask.origin,
        "unit": ask.drive.unit,
        "address": f"{address:04X}H",
        "words": [f"{word:04X}H" for word in words],
    }
