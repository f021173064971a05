"""What a scan found, for people, for programs, and as the beginning of a site file. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from gateway.scan.judge import Suggestion
from gateway.scan.order import Plan, Setting
from gateway.scan.search import Found, Report

SHOWN = 3
"""Suggestions that are told of a unit."""
BIG = 4
"""Reasons against a profile that are told."""


def plan_line(port: str, plan: Plan) -> str:
    """What is about to be done, and how long it takes at most."""
    units = sorted({unit for each in plan.rounds for unit in each.units})
    settings = f"{len(plan.rounds)} settings" if len(plan.rounds) > 1 else str(plan.rounds[0].setting)
    return (
        f"{port}: {settings}, units {spans(units)}, at most {duration(plan.seconds)} "
        f"(each request waits {plan.patience:g} s); reads only, Ctrl-C ends it"
    )


def found_lines(found: Found) -> Iterator[str]:
    """A unit that answers, with the profiles that it may be of."""
    first = found.answer.reply
    how = "" if first is None or first.exception is None else f", with exception {first.exception:02X}H"
    answers = f"answers after {found.answer.seconds * 1000:.1f} ms"
    yield f"unit {found.unit} at {found.setting}: {answers}{how}"
    if not found.likely:
        yield "  none of the profiles fits"
    for rank, suggestion in enumerate(found.suggestions[:SHOWN]):
        yield f"  {suggestion.profile.name}: {_verdict(suggestion)}"
        reasons = suggestion.reasons if rank == 0 else [r for r in suggestion.reasons if not r.fits][:BIG]
        yield from (f"    {'+' if reason.fits else '-'} {reason.text}" for reason in reasons)


def end_lines(plan: Plan, report: Report, strangers: int) -> Iterator[str]:
    """What is to be said when a scan is over."""
    if not report.found:
        yield "nobody answered"
    for setting, pairs in groupby(report.unclear, key=lambda pair: pair[0]):
        units = spans(sorted({unit for _, unit in pairs}))
        yield (
            f"at {setting}: damaged bytes came back from {units} "
            "(noise, another speed or format, or two drives at one address)"
        )
    if strangers:
        yield f"{strangers} bytes came that nobody had asked for: another master may be on the line"
    if left := untried(plan, report):
        more = " (--all tries them too)" if report.found and not plan.all_rounds else ""
        named = ", ".join(map(str, left[:SHOWN])) + (", ..." if len(left) > SHOWN else "")
        yield f"{len(left)} settings were not tried: {named}{more}"


def untried(plan: Plan, report: Report) -> list[Setting]:
    """The settings that were not tried to the end."""
    return [each.setting for each in plan.rounds if each.setting not in report.tried]


def found_object(found: Found) -> dict[str, Any]:
    """A unit for programs; the shape stands in docs/cli.md."""
    setting, reply = found.setting, found.answer.reply
    return {
        "unit": found.unit,
        "framing": setting.framing,
        "baud": setting.baud if setting.serial else None,
        "format": str(setting.format) if setting.serial and not setting.blind else None,
        "exception": None if reply is None else reply.exception,
        "seconds": round(found.answer.seconds, 6),
        "suggestions": [_suggestion_object(suggestion) for suggestion in found.suggestions],
    }


def end_object(port: str, plan: Plan, report: Report, strangers: int, seconds: float) -> dict[str, Any]:
    """The end of a scan for programs; the shape stands in docs/cli.md."""
    return {
        "port": port,
        "found": len(report.found),
        "asked": report.asked,
        "seconds": round(seconds, 3),
        "untried": [str(setting) for setting in untried(plan, report)],
        "unclear": [{"setting": str(setting), "unit": unit} for setting, unit in report.unclear],
        "strangers": strangers,
        "site": "\n".join(site_lines(port, report.found)) if report.found else "",
    }


def site_lines(port: str, found: Sequence[Found]) -> Iterator[str]:
    """The lines of a site file for what was found. One port has one setting: the first one counts."""
    setting = found[0].setting
    yield "lines:"
    yield "  line-1:"
    yield f"    port: {port}"
    if setting.serial:
        yield f"    framing: {setting.framing}"
        best = next((each.likely[0].profile for each in found if each.likely), None)
        form = setting.format_for(best) if best else setting.format
        unseen = "          # a pseudo terminal does not show the format" if setting.blind else ""
        yield f"    serial: {setting.baud} {form}{unseen}"
    elif setting.framing != "tcp":
        yield f"    framing: {setting.framing}"
        yield "    serial: FILL_IN                # speed and format behind the network port"
    yield "    drives:"
    for each in found:
        yield from _drive_lines(each, each.setting == setting)


def _drive_lines(found: Found, here: bool) -> Iterator[str]:
    best = found.suggestions[0] if found.likely else None
    if not here:
        yield f"      # unit {found.unit} answers at {found.setting}: set all drives of a line alike"
    elif best is None:
        yield f"      # unit {found.unit} answers, but no profile fits"
    else:
        open_settings = [s for s in best.profile.settings.values() if s.default is None]
        settings = ", ".join(f"{setting.name}: FILL_IN" for setting in open_settings)
        more = f", settings: {{{settings}}}" if settings else ""
        yield f"      drive-{found.unit}: {{profile: {best.profile.name}, unit: {found.unit}{more}}}"
        yield from (f"        # {setting.name}: {setting.help}" for setting in open_settings)


def _verdict(suggestion: Suggestion) -> str:
    fits, count = suggestion.fits, len(suggestion.reasons)
    title = suggestion.profile.title
    if not suggestion.likely:
        return f"hardly {title}; {fits} of {count} observations fit"
    return f"perhaps {title}; {fits} of {count} observations fit"


def _suggestion_object(suggestion: Suggestion) -> dict[str, Any]:
    return {
        "profile": suggestion.profile.name,
        "title": suggestion.profile.title,
        "likely": suggestion.likely,
        "fits": suggestion.fits,
        "observations": len(suggestion.reasons),
        "reasons": [{"fits": reason.fits, "text": reason.text} for reason in suggestion.reasons],
    }


def spans(numbers: Sequence[int]) -> str:
    """Rising numbers as ``1..3, 7``."""
    parts = []
    for _, group in groupby(enumerate(numbers), key=lambda pair: pair[1] - pair[0]):
        run = [number for _, number in group]
        parts.append(str(run[0]) if len(run) == 1 else f"{run[0]}..{run[-1]}")
    return ", ".join(parts)


def duration(seconds: float) -> str:
    """``45 s``, ``2 min 10 s``."""
    minutes, rest = divmod(max(1, round(seconds)), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
