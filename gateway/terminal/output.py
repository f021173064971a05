"""Answers on standard output: for people in words, with ``--json`` for programs, one object a line."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from typing import Any

import msgspec
import typer
from rich.console import Console

from gateway.bridge.api import ControlState, Diagnosis, Health, PointInfo, RefusedGap
from gateway.tag import Outcome, Quality, Sample, Value, Verdict


def say(text: str) -> None:
    """One line to standard output, at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def console() -> Console:
    """Standard output for tables; wide where it is no terminal, so that nothing is cut off."""
    return Console(width=None if sys.stdout.isatty() else 240, highlight=False)


def say_json(thing: Any) -> None:
    """One JSON object on a line of its own."""
    say(msgspec.json.encode(thing).decode())


def moment(time: int) -> str:
    """Nanoseconds since 1970 as ``2026-11-24T07:05:00.123Z``."""
    seconds, rest = divmod(time, 1_000_000_000)
    clock = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
    return f"{clock}.{rest // 1_000_000:03}Z"


def value_text(sample: Sample, point: PointInfo) -> str:
    """A sample's value as a person reads it: ``59.98 Hz``, ``line``, ``on``; why there is none, if so."""
    if is_named(sample):
        return str(sample.text)
    if sample.value is None:
        return f"- ({sample.reason})" if sample.reason else "-"
    return sample.text or with_unit(sample.value, point)


def is_named(sample: Sample) -> bool:
    """True for what is no number and has a name of its own: ``switched_off``. It is what the drive holds."""
    return sample.quality is Quality.NOT_APPLICABLE and bool(sample.text)


def with_unit(value: Value, point: PointInfo) -> str:
    """A value with its unit, to as many decimals as one count of the register is worth."""
    if isinstance(value, bool):
        return "on" if value else "off"
    text = f"{value:.{_decimals(point.step)}f}" if isinstance(value, float) else str(value)
    return f"{text} {point.unit}" if point.unit else text


def sample_line(sample: Sample, point: PointInfo) -> str:
    """One sample on one line."""
    return f"{moment(sample.time)}  {sample.tag}  {value_text(sample, point)}  {sample.quality}"


def sample_object(sample: Sample, point: PointInfo) -> dict[str, Any]:
    """A sample for programs; the shape stands in docs/cli.md."""
    return {
        "tag": sample.tag,
        "value": sample.value,
        "text": sample.text,
        "unit": point.unit,
        "quality": sample.quality,
        "severity": sample.quality.severity,
        "time": moment(sample.time),
        "age": sample.age,
        "reason": sample.reason,
    }


def health_object(health: Health) -> dict[str, Any]:
    """A gateway's health for programs; the shape stands in docs/cli.md."""
    return {
        **msgspec.to_builtins(health),
        "gaps": [gap_object(gap) for gap in health.gaps],
        "diagnoses": [diagnosis_object(diagnosis) for diagnosis in health.diagnoses],
    }


def diagnosis_object(diagnosis: Diagnosis) -> dict[str, Any]:
    """What is wrong with a line, for programs."""
    return {**msgspec.to_builtins(diagnosis), "since": moment(diagnosis.since)}


def gap_object(gap: RefusedGap) -> dict[str, Any]:
    """A gap that a drive refuses, for programs."""
    return {
        "drive": gap.drive,
        "first": f"{gap.first:04X}H",
        "last": f"{gap.last:04X}H",
        "code": f"{gap.code:02X}H",
        "found": moment(gap.time),
        "points": list(gap.points),
        "text": gap.text,
    }


def outcome_object(outcome: Outcome) -> dict[str, Any]:
    """An outcome for programs; the shape stands in docs/cli.md."""
    return {
        "verdict": outcome.verdict,
        "cause": outcome.cause,
        "reason": outcome.reason,
        "code": outcome.code,
        "drive_error": outcome.drive_error,
        "value": outcome.value,
        "asked": _moment_or_none(outcome.asked),
        "sent": _moment_or_none(outcome.sent),
        "done": _moment_or_none(outcome.done),
    }


def finish(asked: str, outcome: Outcome, as_json: bool) -> None:
    """Print what became of a write or command, and end the program: 0 if it was confirmed, else 1."""
    tell(asked, outcome, as_json)
    raise typer.Exit(0 if outcome.verdict is Verdict.CONFIRMED else 1)


def tell(asked: str, outcome: Outcome, as_json: bool, point: PointInfo | None = None) -> None:
    """Print what became of a write or command; ``point`` is the one that was written."""
    if as_json:
        say_json(outcome_object(outcome))
    else:
        say(outcome_line(asked, outcome, point))


def control_object(state: ControlState) -> dict[str, Any]:
    """Who may command a drive, for programs; the shape stands in docs/cli.md."""
    holder = state.holder
    return {
        "drive": state.drive,
        "phase": state.phase,
        "holder": holder.who if holder else None,
        "through": holder.through if holder else None,
        "address": (holder.address or None) if holder else None,
        "until": _moment_or_none(state.until),
        "then": state.then or None,
        "void": state.void,
        "maintenance": state.maintenance,
        "ramps": dict(state.ramps),
    }


def control_line(state: ControlState) -> str:
    """Who may command a drive, on one line."""
    holder = state.holder
    by = f" by {holder.who} ({', '.join(filter(None, (holder.through, holder.address)))})" if holder else ""
    until = f" until {moment(state.until)}" if state.until else ""
    then = f", then {state.then}" if state.then else ""
    rest = [state.void, state.maintenance and f"in maintenance, {state.maintenance}"]
    rest += [f"{point} on its way to {target:g}" for point, target in state.ramps.items()]
    return "; ".join([f"{state.drive}  {state.phase}{by}{until}{then}", *filter(None, rest)])


def outcome_line(what: str, outcome: Outcome, point: PointInfo | None = None) -> str:
    """An outcome on one line: what was asked, what became of it, and why if not confirmed."""
    value = outcome.value
    why = f": {outcome.reason or outcome.cause}" if outcome.reason or outcome.cause else ""
    if point is not None and value is not None:
        name = point.values.get(value) if isinstance(value, int) else None
        value = name or with_unit(value, point)
    shown = f" (the drive shows {value})" if value is not None else ""
    return f"{outcome.verdict}  {what}{why}{shown}"


def _moment_or_none(time: int) -> str | None:
    return moment(time) if time else None


def _decimals(step: float | None) -> int:
    """Decimals that a step of 0.01 needs: 2."""
    if not step:
        return 3
    return len(f"{step:.6f}".rstrip("0").partition(".")[2])
