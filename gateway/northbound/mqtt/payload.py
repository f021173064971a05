"""What the gateway's messages say, as JSON.

Keys are short and the same everywhere: ``v`` value, ``t`` its text, ``q`` quality (good, uncertain,
bad), ``ts`` time (UTC, ISO 8601, milliseconds), ``u`` unit, ``seq`` running number. For anything that is
not good, ``cause`` says why for programs and ``reason`` for people. Absent keys mean "nothing to say".
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime
from typing import Any

import msgspec

from gateway.bridge.api import (
    API_VERSION,
    DIAGNOSTIC,
    ArgumentInfo,
    CommandInfo,
    ControlState,
    DriveInfo,
    DriveState,
    OwnerInfo,
    PointInfo,
)
from gateway.tag import Cause, Event, Outcome, Quality, Sample, Severity, Value, split_tag

_encode = msgspec.json.Encoder().encode


def iso(nanoseconds: int) -> str:
    """Wall-clock nanoseconds as ``2026-01-31T12:00:00.123Z``."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%dT%H:%M:%S}.{rest // 1_000_000:03}Z"


def _present(**entries: Any) -> dict[str, Any]:
    """The entries that say something: neither None nor an empty text, list or mapping."""
    return {key: value for key, value in entries.items() if value is not None and value not in ("", (), {})}


def _reading(sample: Sample, point: PointInfo) -> dict[str, Any]:
    """Value and quality of a sample. A bad one has no value, whatever the sample carries."""
    severity = sample.quality.severity
    bad = severity is Severity.BAD
    reading: dict[str, Any] = {"v": None if bad else sample.value, "q": severity.value}
    if not bad:
        reading |= _present(t=_text(sample, point))
    if sample.quality is not Quality.GOOD:
        reading |= _present(cause=sample.quality.value, reason=sample.reason)
    return reading


def _text(sample: Sample, point: PointInfo) -> str | None:
    """The name of an enumeration's value."""
    if sample.text is not None or not isinstance(sample.value, int):
        return sample.text
    return point.values.get(sample.value)


def state(sample: Sample, point: PointInfo, seq: int) -> bytes:
    """The present value of one point."""
    about = _present(ts=iso(sample.time), u=point.unit, seq=seq)
    return _encode(_reading(sample, point) | about)


def data(samples: Iterable[tuple[Sample, PointInfo]], seq: int, skipped: int = 0) -> bytes:
    """Samples of one drive that were read together; a value has its own ``ts`` only if it differs."""
    pairs = list(samples)
    newest = max(sample.time for sample, _ in pairs)
    values = {}
    for sample, point in pairs:
        own_time = iso(sample.time) if sample.time != newest else None
        values[point.name] = _reading(sample, point) | _present(ts=own_time)
    return _encode({"seq": seq, "ts": iso(newest)} | _present(skipped=skipped or None) | {"values": values})


def event(happened: Event) -> bytes:
    """Something that happened."""
    point = split_tag(happened.tag)[1]
    about = _present(text=happened.text, point=point, v=happened.value, alarm=happened.alarm)
    return _encode({"name": happened.name, "ts": iso(happened.time)} | about)


def command_refused(name: str, cause: Cause, reason: str, by: str, time: int) -> bytes:
    """The event that tells of a command that should never have been sent."""
    about = _present(command=name, cause=cause.value, text=reason, by=by)
    return _encode({"name": "command_refused", "ts": iso(time)} | about)


def messages_lost(count: int, time: int) -> bytes:
    """The event that tells that the broker did not keep up."""
    text = f"{count} answers, events or data messages were dropped: the broker was away or too slow"
    return _encode({"name": "messages_lost", "ts": iso(time), "text": text, "v": count})


def drive_status(state: DriveState) -> bytes:
    """Whether a drive answers."""
    status = "online" if state.up else "offline"
    return _encode({"status": status, "ts": iso(state.time)} | _present(reason=state.reason))


def lease(state: ControlState, ttl: float) -> bytes:
    """Who may command a drive. ``until`` is told only where nobody renews; else the lease ends ``ttl``
    seconds after its last renewal."""
    counting = state.phase in ("awaited", "open")
    holder = state.holder
    about = _present(
        by=holder.who if holder else None,
        through=holder.through if holder else None,
        address=holder.address if holder else None,
        ttl=ttl if holder else None,
        until=iso(state.until) if counting else None,
        then=state.then,
        void=state.void,
        maintenance=state.maintenance,
        ramps=dict(state.ramps),
    )
    return _encode({"phase": state.phase} | about)


def no_lease(reason: str) -> bytes:
    """Nobody knows who may command a drive: the gateway is gone."""
    return _encode({"phase": "unknown", "reason": reason})


def birth(epoch: str, started: int, version: str, commands: bool, time: int) -> bytes:
    """The gateway is there, and everything retained below its site is current.

    ``epoch`` is what commands name to prove that they were made for this connection; ``commands`` tells
    whether any are taken.
    """
    about = {"api": API_VERSION, "version": version, "started": iso(started), "commands": commands}
    return _encode({"status": "online", "ts": iso(time), "epoch": epoch} | about)


def offline(reason: str, time: int | None = None) -> bytes:
    """The gateway is gone: the will (which cannot know its time), or the last word of an orderly end."""
    return _encode(
        {"status": "offline"} | _present(ts=iso(time) if time is not None else None, reason=reason)
    )


def outcome(id: str | int | None, result: Outcome, time: int, repeated: bool = False) -> bytes:
    """The final answer to a command. ``v`` is what the drive showed on read-back; ``repeated`` marks the
    answer to a command that was seen before and not carried out again."""
    about = _present(
        cause=result.cause.value,
        reason=result.reason,
        code=result.code,
        error=result.drive_error,
        v=result.value,
        repeated=repeated or None,
    )
    return _encode({"id": id, "verdict": result.verdict.value, "ts": iso(result.done or time)} | about)


def meta(drive: DriveInfo, gateway: str, topics: Iterable[str]) -> bytes:
    """What a drive offers. ``topics`` names the points that have a state topic; diagnostics are told only
    where they have one."""
    published = set(topics)
    about = _present(
        gateway=gateway,
        title=drive.title,
        maker=drive.maker,
        model=drive.model,
        profile=drive.profile,
        line=drive.line,
        unit=drive.unit,
    )
    offered = [point for point in drive.points if point.kind != DIAGNOSTIC or point.name in published]
    points = {point.name: _point(point, point.name in published) for point in offered}
    control = {"lease": drive.control.lease} | _present(
        ttl=drive.control.ttl, on_expiry=drive.control.on_expiry, takeover=drive.control.takeover.value
    )
    commands = {c.name: _command(c) for c in drive.commands}
    return _encode(about | {"control": control, "points": points, "commands": commands})


def line_meta(line: OwnerInfo, gateway: str) -> bytes:
    """What all drives of a line can be told at once."""
    return _encode(
        {"gateway": gateway, "title": line.title, "commands": {c.name: _command(c) for c in line.commands}}
    )


def _point(point: PointInfo, published: bool) -> dict[str, Any]:
    return {"kind": point.kind, "access": _access(point), "published": published} | _present(
        **_shape(point),
        group=point.group,
        rate=point.rate,
        step=point.step,
        register=point.register,
        role=point.role.value if point.role and point.writable else None,
        help=point.help,
        source=point.source,
        doubt=point.doubt,
        topic=_elsewhere(point),
    )


def _elsewhere(member: PointInfo | CommandInfo) -> str:
    """What stands in its topics, if that is not its name."""
    return "" if member.topic == member.name else member.topic


def _access(point: PointInfo) -> str:
    if not point.writable:
        return "read"
    return "read-write" if point.readable else "write"


def _command(command: CommandInfo) -> dict[str, Any]:
    args = {arg.name: _present(**_shape(arg), point=arg.point) for arg in command.args}
    return {"args": args, "role": command.role.value} | _present(help=command.help, topic=_elsewhere(command))


def _shape(info: PointInfo | ArgumentInfo) -> dict[str, Any]:
    """Type, unit, limits and names of values, alike for points and arguments."""
    limits: tuple[Value, ...] = () if info.low is None and info.high is None else (info.low, info.high)
    values = {str(number): name for number, name in info.values.items()}
    return {"type": info.type.value, "unit": info.unit, "range": limits, "values": values}
