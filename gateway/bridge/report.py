"""What the core tells of itself when it is asked: health, alarms, demands and the wire trace."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec


class LineHealth(msgspec.Struct, frozen=True, kw_only=True):
    """Counters of one line since start."""

    name: str
    port: str
    up: bool
    reason: str
    requests: int
    answered: int
    refused: int
    timeouts: int
    damaged: int
    """Frames with wrong check bytes, and noise that was skipped."""
    utilisation: float
    """Share of the last ten seconds that the wire was in use, 0 to 1."""


class Alarm(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something that somebody has to look at. ``subject`` is a drive, a line (``_north``) or the gateway
    itself (``_gateway``); the times are wall-clock nanoseconds, 0 when that has not happened."""

    key: str
    """What it is acknowledged by: ``fan-1.restarted``."""
    subject: str
    name: str
    text: str
    raised: int
    cleared: int = 0
    """When its cause was gone."""
    acknowledged: int = 0
    by: str = ""
    """Who acknowledged it."""

    @property
    def is_over(self) -> bool:
        """Its cause is gone, and somebody has seen it."""
        return bool(self.cleared and self.acknowledged)


class RefusedGap(msgspec.Struct, frozen=True, kw_only=True):
    """Addresses that no point has, across which a drive does not let itself be read, and the exception
    ``code`` with which it says so; or the registers of ``points`` that a drive has not although its profile
    names them. ``time`` is when that was found."""

    drive: str
    profile: str
    unit: int
    first: int
    last: int
    code: int
    time: int
    points: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """What was found, and what to do about it."""
        span = f"{self.first:04X}H" if self.first == self.last else f"{self.first:04X}H..{self.last:04X}H"
        if self.points:
            names = ", ".join(self.points)
            return (
                f"{self.drive} answers {self.code:02X}H for {span} ({names}); its neighbours "
                "are read without it, and it is asked for once a minute (see whether it is of the model "
                f"and firmware of the profile {self.profile})"
            )
        return (
            f"{self.drive} refuses reads across {span} with {self.code:02X}H; what stands on both sides is "
            f"read apart (add `{span}` to `holes` in the profile {self.profile})"
        )


class Diagnosis(msgspec.Struct, frozen=True, kw_only=True):
    """Something that is wrong with a line: a code for programs (`gateway.line.doctor.finding.Illness`), one
    sentence, the numbers that speak for it, and what to do. ``severity`` is error, warning or info;
    ``drives`` are those concerned (none: the line); ``since`` when it was found."""

    line: str
    code: str
    severity: str
    text: str
    remedy: str
    drives: tuple[str, ...] = ()
    evidence: Mapping[str, float] = {}
    since: int = 0


class Health(msgspec.Struct, frozen=True, kw_only=True):
    """How the core is doing."""

    started: int
    lines: tuple[LineHealth, ...]
    drives: Mapping[str, bool]
    """Drive name to whether it answers."""
    sessions: tuple[str, ...]
    journal: str = ""
    """Empty when the journal can be written, else why not."""
    alarms: tuple[Alarm, ...] = ()
    """Every alarm that stands, the oldest first."""
    gaps: tuple[RefusedGap, ...] = ()
    """What drives turned out not to let themselves be read across."""
    diagnoses: tuple[Diagnosis, ...] = ()
    """What is wrong with the lines."""


class Reading(msgspec.Struct, frozen=True, kw_only=True):
    """One read of the present plan; times are seconds. ``cost`` is what it takes of the wire, ``age`` how
    old a value can get at worst."""

    unit: int
    table: str
    address: int
    count: int
    period: float
    cost: float
    age: float


class Demand(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Who wants a tag how often (seconds), and the read that brings it; None while nobody wants it, or
    where it is read behind a selector."""

    wanted: tuple[tuple[str, float], ...] = ()
    reading: Reading | None = None
    gaps: tuple[RefusedGap, ...] = ()
    """Those at which that read ends, because the drive does not let itself be read across them."""


class Frame(msgspec.Struct, frozen=True, array_like=True):
    """One frame of the wire trace: when its first bit was on the wire (nanoseconds since 1970, exact to the
    microsecond), sent or received, its bytes, and what they were."""

    time: int
    sent: bool
    data: bytes
    note: str = ""


class TracePage(msgspec.Struct, frozen=True, array_like=True):
    """Some frames of a wire trace, oldest first. Frames are numbered from 1; ``first`` is the number of the
    first one here, ``last`` that of the newest that is kept."""

    first: int
    frames: tuple[Frame, ...]
    last: int
