"""A procedure under way: what it waits for, and what is known of it. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gateway.core.procedure import Ask, Effect, Procedure
from gateway.mapping.profile import Condition
from gateway.tag import Cause, Outcome, Verdict


@dataclass(slots=True)
class Running:
    """A procedure under way and what it waits for."""

    ask: Ask
    procedure: Procedure
    effect: Effect | None = None
    job: int | None = None
    note: int | None = None
    wake: float | None = None
    told: bool = False
    """The asker has his outcome, but there is more to do (a stop that is not answered)."""
    sent: float | None = None
    """When the first frame that could change the drive left (monotonic)."""
    frames: int = 0
    """Frames put on record."""
    recorded: int | None = None
    """The frame that is on record and has not left yet."""
    wears: Sequence[str] = ()
    """The registers that the frame put on record last wears."""
    outrun: bool = False
    """A newer ask for one of its setpoints, or for all drives of its line, came. That counts for good, also
    when that one is done before this one goes on."""
    ramp: str | None = None
    """The setpoint that it is taking somewhere."""
    owing: bool = False
    """Its frames end what was begun."""
    will_owe: bool = False
    """It is owing from the moment at which its next frame leaves."""
    objection: Outcome | None = None
    """Why its frames may not go any more."""


def faulty(running: Running, error: Exception) -> Outcome:
    """The outcome of a procedure that broke: not done, or, once something was sent, not known."""
    verdict = Verdict.FAILED if running.sent is None else Verdict.UNKNOWN
    reason = f"a fault in the gateway, please report it: {error!r}"
    return Outcome(verdict=verdict, cause=Cause.INTERNAL, reason=reason)


def tags_of(running: Running, condition: Condition) -> list[str]:
    return [drive.tag(term.name) for drive in running.ask.drives for term in condition if not term.setting]


def names_of(running: Running) -> list[str]:
    return [drive.name for drive in running.ask.drives]


def name_of(running: Running) -> str:
    return f"proof {running.ask.number}"
