"""Does a drive answer as its profile says? Judges one reading of everything readable. Pure.

A *contradiction* means that profile and drive do not belong together as they are: a register that the
drive does not have, a value that the profile calls impossible. A *remark* is worth knowing, no more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from gateway.bridge.api import DriveInfo, PointInfo
from gateway.mapping.lossdemand import Shown, described, judge, settings_of
from gateway.mapping.profile import Profile
from gateway.mapping.site import DriveConfig
from gateway.tag import Quality, Sample, split_tag
from gateway.terminal.output import value_text, with_unit

KEEP_RUNNING = "keep_running"
SOURCES = ("run_source", "frequency_source", "operation_mode")
"""Points that tell whether the line is obeyed, by their standard names."""
RUNNING = ("run_forward", "run_reverse")
"""Commands whose preconditions tell the same."""
STATION = "station_address"
"""A point that shows the unit address that is set on the drive."""
_AWAY = (Quality.NO_COMMUNICATION, Quality.LINE_DOWN, Quality.STALE)
_REFUSED = (Quality.REFUSED, Quality.CONFIGURATION)


@dataclass(frozen=True, slots=True)
class Found:
    """What one drive showed. ``unread`` are points behind a selector: reading them would write."""

    config: DriveConfig
    info: DriveInfo
    samples: Mapping[str, Sample]
    """By point."""
    unread: Sequence[str]

    @property
    def answers(self) -> bool:
        """True when at least one value came from the drive, be it a refusal."""
        return any(sample.quality not in (*_AWAY, Quality.WAITING) for sample in self.samples.values())

    @property
    def contradictions(self) -> list[str]:
        """What does not fit the profile; nothing but the silence if the drive is away."""
        if not self.answers:
            reasons = {s.reason for s in self.samples.values() if s.quality in _AWAY and s.reason}
            return [f"it does not answer: {', '.join(sorted(reasons)) or 'nothing could be read'}"]
        if self.doubt:
            return [self.doubt]
        told = {told: None for name in self.samples for told in self._contradiction(name)}
        return [*told, *self._loss_contradiction()]

    @property
    def doubt(self) -> str:
        """Why the drive is not of the model that the site says; then nothing else of it means anything."""
        doubted = (s for s in self.samples.values() if s.quality is Quality.CONFIGURATION)
        return next((sample.reason for sample in doubted), "") if self.config.profile.modbus.identity else ""

    @property
    def remarks(self) -> list[str]:
        """What is worth knowing."""
        return list(_remarks(self)) if self.answers else []

    def shown(self, name: str) -> str | None:
        """The value of a point, or else of a setting, in words; None when there is neither."""
        if name in self.samples:
            return value_text(self.samples[name], self.point(name))
        setting = self.config.profile.settings.get(name)
        if setting is None or name not in self.config.settings:
            return None
        value = self.config.settings[name]
        return setting.values.get(int(value), f"{float(value):g}")

    @property
    def sources(self) -> dict[str, str]:
        """What decides whether the line is obeyed: points and settings with their present values."""
        commands = [c for name, c in self.config.profile.commands.items() if name in RUNNING]
        names = dict.fromkeys([*SOURCES, *(term.name for c in commands for term in c.only_when)])
        return {name: text for name in names if (text := self.shown(name)) is not None}

    def look(self, name: str) -> Shown | None:
        """The value of a point, or else of a setting, as a number and in words."""
        sample = self.samples.get(name)
        if sample is None or sample.value is None or isinstance(sample.value, str):
            return settings_of(self.config)(name)
        return Shown(Fraction(str(float(sample.value))), value_text(sample, self.point(name)))

    def _loss_contradiction(self) -> Iterator[str]:
        """What the site demands of the drive when the line dies, and the drive does not."""
        if self.config.comm_loss is not None:
            judgement = judge(self.config.profile.serial.comm_loss, self.config.comm_loss, self.look)
            if not judgement.met:
                yield judgement.reason

    def point(self, name: str) -> PointInfo:
        """A point as clients know it."""
        return next(point for point in self.info.points if point.name == name)

    def _contradiction(self, name: str) -> Iterator[str]:
        point, sample = self.point(name), self.samples[name]
        place = f"{name} ({point.register})"
        if sample.quality in _REFUSED:
            yield f"{self._register(name)} cannot be read: {sample.reason or sample.quality}"
        elif sample.quality in (*_AWAY, Quality.WAITING):
            yield f"{self._register(name)} brought no value: {sample.reason or sample.quality}"
        elif name == STATION and sample.value != self.config.unit:
            yield f"{place} is {sample.value}, but the site says unit {self.config.unit}"
        elif _is_unnamed(point, sample):
            yield f"{place} is {sample.value}, which is none of {', '.join(point.values.values())}"
        elif _is_outside(point, sample) and name not in self.config.ranges:
            yield f"{place} is {value_text(sample, point)}, outside {_range_text(point)}"

    def _register(self, name: str) -> str:
        """A register that has no value, and what stands in it: its bits are told together."""
        register, said = self.point(name).register.partition(".")[0], self.samples[name]
        names = [
            other
            for other, sample in self.samples.items()
            if self.point(other).register.partition(".")[0] == register
            and (sample.quality, sample.reason) == (said.quality, said.reason)
        ]
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        return f"{names[0]}{more} ({register})"


def found(config: DriveConfig, info: DriveInfo, samples: Sequence[Sample]) -> Found:
    """What the samples of a drive's points show."""
    by_point = {split_tag(sample.tag)[1]: sample for sample in samples}
    return Found(config, info, by_point, behind_selector(config.profile))


def behind_selector(profile: Profile) -> list[str]:
    """Points that cannot be read without writing a selector first."""
    return [point.name for point in profile.points.values() if point.select and point.access.readable]


def found_object(seen: Found) -> dict[str, Any]:
    """For programs; the shape stands in docs/cli.md."""
    return {
        "drive": seen.config.name,
        "line": seen.config.line,
        "unit": seen.config.unit,
        "profile": seen.config.profile.name,
        "answers": seen.answers,
        "read": len(seen.samples),
        "good": sum(sample.quality is Quality.GOOD for sample in seen.samples.values()),
        "not_applicable": _absent(seen),
        "refused": [name for name, sample in seen.samples.items() if sample.quality in _REFUSED],
        "unread": list(seen.unread),
        "sources": seen.sources,
        "comm_loss_action": _comm_loss(seen),
        "comm_loss": described(seen.config.profile.serial.comm_loss, seen.look),
        "contradictions": seen.contradictions,
        "remarks": seen.remarks,
    }


def found_lines(seen: Found) -> Iterator[str]:
    """For people: a headline, then what was read, and what is wrong or worth knowing."""
    config = seen.config
    head = f"{config.name} ({config.profile.name}, unit {config.unit} on {config.line})"
    yield f"{head}: {'answers' if seen.answers else 'does not answer'}"
    if seen.answers:
        good = sum(sample.quality is Quality.GOOD for sample in seen.samples.values())
        yield f"  read: {good} of {len(seen.samples)} points have a value"
        yield from (f"  {name}: {text}" for name, text in seen.sources.items())
        yield f"  when the line dies: {_loss_text(seen)}"
    yield from (f"  contradiction: {text}" for text in seen.contradictions)
    yield from (f"  remark: {text}" for text in seen.remarks)


def _remarks(seen: Found) -> Iterator[str]:
    blind = seen.config.profile.serial.comm_loss.blind
    if seen.config.comm_loss is None and (blind or _comm_loss(seen) == KEEP_RUNNING):
        yield "the drive keeps running when the line dies: nothing can stop it from here then"
    for name in seen.config.ranges:
        if name in seen.samples and _is_outside(seen.point(name), seen.samples[name]):
            point = seen.point(name)
            shown = value_text(seen.samples[name], point)
            yield f"{name} is {shown}, outside {_range_text(point)} of this site"
    if absent := _absent(seen):
        yield f"not there in the present mode: {', '.join(absent)}"
    if unread := list(seen.unread):
        yield f"not read, because a selector would have to be written: {', '.join(unread)}"


def _absent(seen: Found) -> list[str]:
    """The points that are not there in the present mode; what has a name in place of a number is there."""
    absent = (name for name, sample in seen.samples.items() if sample.quality is Quality.NOT_APPLICABLE)
    return [name for name in absent if not seen.samples[name].text]


def _comm_loss(seen: Found) -> str | None:
    """What the drive says, or the site says of it, that it does when the line dies."""
    action = seen.config.profile.serial.comm_loss.action
    return seen.shown(action) if action else None


def _loss_text(seen: Found) -> str:
    """As the profile understands the action; the action alone where it does not."""
    loss = seen.config.profile.serial.comm_loss
    understood = described(loss, seen.look) if loss.stops_when is not None or loss.blind else None
    told = understood or _comm_loss(seen) or "not known"
    point = seen.point(loss.action) if loss.action is not None and loss.action in seen.samples else None
    raw = understood is None and point is not None and not point.values
    return f"{told} ({point.doubt or 'the profile does not say what it means'})" if raw and point else told


def _is_unnamed(point: PointInfo, sample: Sample) -> bool:
    return bool(point.values) and sample.value is not None and sample.text is None


def _is_outside(point: PointInfo, sample: Sample) -> bool:
    """True when a number lies outside the range for writing; enumerations are judged by their names."""
    value = sample.value
    if point.values or isinstance(value, (bool, str)) or value is None:
        return False
    return (point.low is not None and value < point.low) or (point.high is not None and value > point.high)


def _range_text(point: PointInfo) -> str:
    ends = [None if end is None else with_unit(end, point) for end in (point.low, point.high)]
    return f"{ends[0] or 'any'} to {ends[1] or 'any'}"
