"""Entries of the journal: which of them are wanted, and how they are told. Pure."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from gateway.core.audit import Checked
from gateway.terminal.errors import UsageError
from gateway.terminal.output import moment

Entry = Mapping[str, Any]

NANO = 10**9
_AGO = re.compile(r"(\d+(?:\.\d+)?)([smhd])", re.ASCII)
_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400}
MOMENTS = ("asked", "sent", "done")
NOT_TOLD = ("hash", "n", "kind", "time", "mono", "lived", "boot")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Which entries are wanted; what is None or empty asks for nothing. Times are nanoseconds since 1970."""

    drive: str = ""
    who: str = ""
    since: int | None = None
    until: int | None = None
    outcome: str = ""
    kind: str = ""
    ask: int | None = None

    def takes(self, entry: Entry) -> bool:
        """True for an entry that is wanted. Snapshots are for the gateway; they must be asked for."""
        time = entry.get("time", 0)
        return (
            (entry["kind"] == self.kind if self.kind else entry["kind"] != "snapshot")
            and (self.since is None or time >= self.since)
            and (self.until is None or time < self.until)
            and (self.ask is None or entry.get("ask") == self.ask)
            and (not self.drive or fnmatch.fnmatchcase(drive_of(entry), self.drive))
            and (not self.who or fnmatch.fnmatchcase((entry.get("by") or {}).get("who", ""), self.who))
            and (not self.outcome or _verdict(entry) == self.outcome)
        )


def _verdict(entry: Entry) -> str:
    outcome = entry.get("outcome")
    return str(outcome["verdict"]) if isinstance(outcome, dict) else ""


def drive_of(entry: Entry) -> str:
    """The drive that an entry is about, "" if it is about none."""
    inner = entry.get("alarm") or entry.get("gap") or {}
    named = entry.get("drive") or entry.get("what", "").partition(".")[0]
    return str(named or inner.get("subject") or inner.get("drive") or "")


def time_of(text: str, now: int) -> int:
    """``2026-11-24``, ``2026-11-24T12:00`` (UTC unless it says otherwise), or ``8h``: so long ago.

    Raises:
        UsageError: if it is none of these.
    """
    if match := _AGO.fullmatch(text):
        return now - int(float(match[1]) * _SECONDS[match[2]] * NANO)
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        reason = f"{text!r} is no time (write 2026-11-24T12:00, or 8h for so long ago)"
        raise UsageError(reason) from None
    whole = when.replace(tzinfo=UTC) if when.tzinfo is None else when
    return int(whole.timestamp()) * NANO + whole.microsecond * 1000


def entry_object(entry: Entry, place: str) -> dict[str, Any]:
    """An entry for programs; the shape stands in docs/cli.md."""
    told = {**entry, "time": moment(entry.get("time", 0)), "place": place}
    outcome = entry.get("outcome")
    if isinstance(outcome, dict):
        told["outcome"] = {
            name: (moment(value) if value else None) if name in MOMENTS else value
            for name, value in outcome.items()
        }
    return told


def entry_line(entry: Entry) -> str:
    """An entry on one line, for people."""
    words = _WORDS.get(entry["kind"], _other)
    return f"{moment(entry.get('time', 0))}  {words(entry)}"


def _intent(entry: Entry) -> str:
    changes = ", ".join(
        f"{name} {_value(entry['old'].get(name))} -> {_value(new)}" for name, new in entry["new"].items()
    )
    frame = f"unit {entry['unit']} {entry['address']}: {' '.join(entry['words'])}"
    asked = _asked(entry) if entry["what"] else f"#{entry['ask']} (the gateway's own)"
    return f"{asked}: about to send {changes} ({frame})"


def _outcome(entry: Entry) -> str:
    outcome = entry["outcome"]
    shown = f", the drive shows {_value(outcome['value'])}" if outcome.get("value") is not None else ""
    reason = f": {outcome['reason']}" if outcome.get("reason") else ""
    return f"{_asked(entry)}: {outcome['verdict']}{reason}{shown}"


def _late(entry: Entry) -> str:
    outcome = entry["outcome"]
    return f"#{entry['ask']}: in the end {outcome['verdict']} {outcome.get('reason', '')}".rstrip()


def _asked(entry: Entry) -> str:
    return f"#{entry['ask']} {entry['what']}{_wanted(entry['wanted'])}{_by(entry)}"


def _wanted(wanted: Any) -> str:
    if isinstance(wanted, dict):
        return "".join(f" {name}={_value(value)}" for name, value in wanted.items())
    return f" = {_value(wanted)}"


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return "?" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _turned(entry: Entry) -> str:
    more = f" ({entry['passed_over']} more before it)" if "passed_over" in entry else ""
    reason = entry["outcome"].get("reason", "")
    return f"{entry['what']} = {_value(entry['wanted'])}{_by(entry)}: turned away: {reason}{more}"


def _lease(entry: Entry) -> str:
    reason = f" ({entry['reason']})" if entry.get("reason") else ""
    due = f"; due now: {entry['due']}" if entry.get("due") else ""
    return f"lease of {entry['drive']} {entry['did']}{_by(entry)}{reason}{due}"


def _maintenance(entry: Entry) -> str:
    return f"maintenance of {entry['drive']} {'on' if entry['on'] else 'off'}{_by(entry)}"


def _asked_for(entry: Entry) -> str:
    """A lease or maintenance that was asked for and refused."""
    what = entry["kind"].removesuffix("_asked")
    outcome = entry["outcome"]
    return f"{what} {entry['what']}{_by(entry)}: {outcome['verdict']}: {outcome.get('reason', '')}"


def _by(entry: Entry) -> str:
    by = entry.get("by")
    if not by:
        return ""
    way = ", ".join(filter(None, (by["through"], by.get("address", ""))))
    return f" by {by['who']} ({way}{'' if by.get('authenticated', True) else ', not authenticated'})"


def _boot(entry: Entry) -> str:
    before = "" if entry["ended"] else "; the run before did not end in good order"
    cut = f"; {entry['cut']} bytes of a half-written line were cut off" if entry["cut"] else ""
    broken = f"; the journal was changed: {entry['broken']}" if entry["broken"] else ""
    about = f"version {entry['version']}, configuration {entry['configuration'][:12]}"
    return f"run {entry['run']} begins ({about}){before}{cut}{broken}"


def _alarm(entry: Entry) -> str:
    return f"alarm {entry['did']}{_by(entry)}: {entry['alarm']['key']}: {entry['alarm']['text']}"


def _clock(entry: Entry) -> str:
    return f"the clock was set {'forward' if entry['jump'] > 0 else 'back'} by {abs(entry['jump']):g} s"


def _other(entry: Entry) -> str:
    """Whatever kinds there will be."""
    facts = " ".join(f"{name}={value}" for name, value in entry.items() if name not in NOT_TOLD)
    return f"{entry['kind']} {facts}".rstrip()


_WORDS: Mapping[str, Callable[[Entry], str]] = {
    "intent": _intent,
    "outcome": _outcome,
    "late outcome": _late,
    "turned away": _turned,
    "lease": _lease,
    "lease_asked": _asked_for,
    "maintenance": _maintenance,
    "maintenance_asked": _asked_for,
    "unsent": lambda entry: f"#{entry['ask']}: frame {entry['frame']} was not sent after all",
    "spared": lambda entry: f"#{entry['ask']}: frame {entry['frame']} wore nothing",
    "boot": _boot,
    "end": lambda entry: "the gateway ends",
    "alarm": _alarm,
    "clock": _clock,
    "lost": lambda entry: f"{entry['entries']} entries were lost while the disk failed",
    "snapshot": lambda entry: f"snapshot; the line before it has the hash {entry['after']}",
}


def checked_object(found: Checked) -> dict[str, Any]:
    """What a look at every line showed, for programs; the shape stands in docs/cli.md."""
    return {
        "whole": not found.breaks,
        "files": found.files,
        "entries": found.entries,
        "first": found.first.n if found.first else None,
        "last": found.last.n,
        "hash": found.last.hash,
        "breaks": [{"file": b.file, "line": b.line, "n": b.n, "problem": b.problem} for b in found.breaks],
        "half": found.half or None,
        "unended": found.unended,
    }


def checked_lines(found: Checked) -> list[str]:
    """The same for people: each break at its place, then the whole."""
    lines = [f"{b.file}:{b.line}: {b.problem}" for b in found.breaks]
    first = found.first.n if found.first else 0
    state = "broken" if found.breaks else "whole"
    lines.append(
        f"{state}: {found.entries} entries in {found.files} files, {first} to {found.last.n}; "
        f"the last hash is {found.last.hash}"
    )
    if first > 1:
        lines.append(f"what came before entry {first} was rotated away or removed; this cannot tell which")
    if found.unended:
        runs = ", ".join(map(str, found.unended))
        lines.append(f"did not end in good order, so their last entries may be missing: run {runs}")
    if found.half:
        lines.append(f"half a line at the end of {found.half}: being written now, or never finished")
    return lines
