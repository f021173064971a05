"""Does a drive do what the site demands when the line dies (``docs/safety.md`` H9)? Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import NamedTuple

from gateway.mapping.condition import Condition, Term
from gateway.mapping.device import CommLoss
from gateway.mapping.site import DriveConfig, LossDemand


class Shown(NamedTuple):
    """The present value of a point or setting, and how people write it."""

    number: Fraction
    text: str


Look = Callable[[str], Shown | None]
"""The present value of the point or setting of that name; None while it is not known."""


class Judgement(NamedTuple):
    """``met`` is None while nobody can tell. ``reason`` says why it is not met, or what is missing."""

    met: bool | None
    reason: str = ""


MET = Judgement(True)


def judge(loss: CommLoss, demand: LossDemand, look: Look) -> Judgement:
    """Whether the drive does what is demanded, by what it shows now."""
    if demand.action == "any":
        return MET
    if demand.action == "keep_running":
        return _runs_on(loss, look)
    stops = _stops(loss, look)
    return _in_time(loss, demand.within, look) if stops.met and demand.within is not None else stops


def described(loss: CommLoss, look: Look) -> str | None:
    """What the drive does when the line dies, in words; None while it is not known yet."""
    if loss.blind:
        return "keeps running: its settings tell it not to watch the line"
    action = look(loss.action) if loss.action else None
    does = f"{loss.action} is {action.text}" if action else ""
    if loss.stops_when is None:
        return does or (None if loss.action else "not known")
    if any(_contradictions((*loss.when, *loss.stops_when), look)):
        return f"keeps running: {does}" if does else "keeps running"
    if _missing(loss, look):
        return None
    after = loss.after if loss.after is not None or not loss.after_from else look(loss.after_from)
    seconds = (
        f" {float(after.number if isinstance(after, Shown) else after):g} s" if after is not None else ""
    )
    return f"stops{' after' + seconds if seconds else ''}: {does}" if does else "stops"


def settings_of(drive: DriveConfig) -> Look:
    """Looks at the settings of a drive, and at nothing that only the drive itself could show."""

    def look(name: str) -> Shown | None:
        number = drive.settings.get(name)
        if number is None:
            return None
        setting = drive.profile.settings.get(name)
        names = setting.values if setting else {}
        return Shown(number, names.get(int(number), f"{float(number):g}"))

    return look


def _stops(loss: CommLoss, look: Look) -> Judgement:
    """The motor stops if the drive watches the line and its action stops it: every term holds."""
    if loss.blind and not loss.when:
        return Judgement(False, "it must stop when the line dies, and does not watch the line")
    if not loss.blind and loss.stops_when is None:
        return Judgement(
            False, "it must stop when the line dies, and its profile does not say whether it does"
        )
    wrong = list(_contradictions((*loss.when, *(loss.stops_when or ())), look))
    if wrong:
        return Judgement(False, f"it must stop when the line dies: {'; '.join(wrong)}")
    missing = _missing(loss, look)
    return Judgement(None, f"{missing}, which tells whether it stops when the line dies") if missing else MET


def _runs_on(loss: CommLoss, look: Look) -> Judgement:
    """The motor runs on if any term is contradicted."""
    if loss.blind or any(_contradictions((*loss.when, *(loss.stops_when or ())), look)):
        return MET
    if loss.stops_when is None:
        text = "it must keep running when the line dies, and its profile does not say whether it does"
        return Judgement(False, text)
    missing = _missing(loss, look)
    if missing:
        return Judgement(None, f"{missing}, which tells whether it runs on when the line dies")
    terms = loss.stops_when or loss.when
    shown = "; ".join(f"{term.name} is {_text(term, look)}" for term in terms)
    return Judgement(False, f"it must keep running when the line dies, but {shown}")


def _in_time(loss: CommLoss, within: float, look: Look) -> Judgement:
    after, where = loss.after, ""
    if after is None and loss.after_from is not None:
        shown = look(loss.after_from)
        if shown is None:
            return Judgement(None, f"{loss.after_from}, which tells when it stops, is not known")
        after, where = float(shown.number), f" ({loss.after_from})"
    if after is None:
        text = (
            f"it must stop within {within:g} s of the line's death, and nobody knows after what time it does"
        )
        return Judgement(False, text)
    if after > within:
        return Judgement(
            False, f"it stops {after:g} s after the line died{where}; it must within {within:g} s"
        )
    return MET


def _contradictions(condition: Condition, look: Look) -> Iterator[str]:
    """What is known to be otherwise than the condition says."""
    for term in condition:
        shown = look(term.name)
        if shown is not None and not any(low <= shown.number <= high for low, high in term.ranges):
            yield f"{term.name} is {shown.text}, and must be {_demanded(term)}"


def _demanded(term: Term) -> str:
    """``[a, b, c]`` of a condition as ``a, b or c``."""
    wanted = term.text.removeprefix(f"{term.name}: ").strip("[]").split(", ")
    return wanted[0] if len(wanted) == 1 else f"{', '.join(wanted[:-1])} or {wanted[-1]}"


def _missing(loss: CommLoss, look: Look) -> str:
    terms = (*loss.when, *(loss.stops_when or ()))
    return ", ".join(dict.fromkeys(term.name for term in terms if look(term.name) is None))


def _text(term: Term, look: Look) -> str:
    shown = look(term.name)
    return shown.text if shown else "not known"
