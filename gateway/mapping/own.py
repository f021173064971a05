"""The points that are in no profile: what the gateway tells of itself, its lines, its dealings with drives.

Their names cannot be those of points in profiles: they begin with an underscore, or belong to an owner whose
name does (see `gateway.tag`). Here is what they are; `gateway.core` knows their values.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from gateway.mapping.profile import Profile
from gateway.tag import ValueType


@dataclass(frozen=True, slots=True)
class OwnPoint:
    """One datum that the gateway found out by itself. ``values`` names the numbers of an enumeration."""

    name: str
    help: str
    type: ValueType = ValueType.INTEGER
    unit: str | None = None
    group: str = "diagnostics"
    values: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))


def _named(points: Iterable[OwnPoint]) -> Mapping[str, OwnPoint]:
    return MappingProxyType({point.name: point for point in points})


_NUMBER, _TEXT = ValueType.NUMBER, ValueType.TEXT

OF_CONTROL: Mapping[str, OwnPoint] = _named(
    (
        OwnPoint(
            "_locked", "Somebody holds the lease, or may return to it", ValueType.BOOLEAN, group="lease"
        ),
        OwnPoint("_lease_holder", "Who holds the lease; empty when nobody does", _TEXT, group="lease"),
        OwnPoint("_lease_through", "By which way he comes, and from where", _TEXT, group="lease"),
        OwnPoint("_lease_left", "When the lease ends unless it is renewed", _NUMBER, "ms", group="lease"),
        OwnPoint(
            "_maintenance",
            "Who works on the drive, so that only stops pass; else empty",
            _TEXT,
            group="lease",
        ),
        OwnPoint("_ramp", "Where the setpoint is on its way to; empty when it is not", _TEXT, group="lease"),
    )
)
"""What the gateway adds to each drive about who commands it."""
DEALINGS: Mapping[str, OwnPoint] = _named(
    (
        OwnPoint("_requests", "Requests to the drive since start"),
        OwnPoint("_answered", "Normal replies since start"),
        OwnPoint("_refused", "Exception replies since start"),
        OwnPoint("_exceptions", "How often each exception code came since start: 02H: 3, 22H: 1", _TEXT),
        OwnPoint("_timeouts", "Requests since start to which nothing came back"),
        OwnPoint("_damaged", "Requests since start to which only damaged or foreign bytes came back"),
        OwnPoint("_retries", "Requests since start after one that was not answered"),
        OwnPoint("_probes", "Requests since start that only asked whether the drive is back"),
        OwnPoint("_early_replies", "Replies since start that began before the silence was over"),
        OwnPoint("_bytes_sent", "Bytes sent to the drive since start"),
        OwnPoint("_bytes_received", "Bytes that came back since start"),
        OwnPoint("_turnaround_p50", "Half of the replies of the last minutes began sooner", _NUMBER, "ms"),
        OwnPoint("_turnaround_p95", "95 % of the replies of the last minutes began sooner", _NUMBER, "ms"),
        OwnPoint("_turnaround_max", "The slowest reply of the last minutes", _NUMBER, "ms"),
        OwnPoint("_jitter", "How much the turnaround of one reply differs from the next", _NUMBER, "ms"),
        OwnPoint("_worst_age", "The oldest that a value got in the last minutes", _NUMBER, "s"),
        OwnPoint("_age_share", "The same as a share of what was promised; above 100: broken", _NUMBER, "%"),
    )
)
"""How the line gets on with a drive."""

OF_A_DRIVE: Mapping[str, OwnPoint] = _named(
    (
        *DEALINGS.values(),
        OwnPoint("_comm_loss", "What the drive does when the line dies", _TEXT, group="supervision"),
        OwnPoint(
            "_identity", "Whether the drive is of the model that the site says", _TEXT, group="supervision"
        ),
        OwnPoint(
            "_last_outcome",
            "What the drive was asked last, by whom, and what became of it",
            _TEXT,
            group="supervision",
        ),
        OwnPoint("_writes_today", "Writes of the last 24 hours that wear the drive's memory", group="wear"),
        *OF_CONTROL.values(),
    )
)
"""What the gateway adds to each drive."""


def of_a_drive(profile: Profile) -> Mapping[str, OwnPoint]:
    """What the gateway adds to a drive of this profile."""
    lasting = [point.name for point in profile.points.values() if isinstance(point.wear, int)]
    return MappingProxyType(
        {
            **OF_A_DRIVE,
            **_named(
                OwnPoint(f"_writes_today_{name}", f"Writes of {name} in the last 24 hours", group="wear")
                for name in lasting
            ),
            **_named(
                OwnPoint(
                    f"_writes_left_{name}", f"Writes that the memory of {name} is good for yet", group="wear"
                )
                for name in lasting
            ),
        }
    )


OF_A_LINE: Mapping[str, OwnPoint] = _named(
    (
        OwnPoint("condition", "healthy, or the codes of what is wrong with the line", _TEXT),
        OwnPoint("diagnosis", "What is wrong with the line, and what to do about it; empty: nothing", _TEXT),
        OwnPoint("utilisation", "Share of the last ten seconds that the wire was in use", _NUMBER, "%"),
        OwnPoint("load", "Share of the wire that the planned reads take", _NUMBER, "%"),
        OwnPoint("stretch", "By how much the longest period is longer than wanted; 1: it is not", _NUMBER),
        OwnPoint("requests", "Requests sent since start"),
        OwnPoint("answered", "Normal replies since start"),
        OwnPoint("refused", "Exception replies since start"),
        OwnPoint("timeouts", "Requests without any reply since start"),
        OwnPoint("damaged", "Requests to which only damaged or foreign bytes came back, since start"),
        OwnPoint("retries", "Requests since start after one that was not answered"),
        OwnPoint("probes", "Requests since start that only asked whether a drive is back"),
        OwnPoint("bytes_sent", "Bytes sent since start"),
        OwnPoint("bytes_received", "Bytes received since start, those that nobody asked for included"),
        OwnPoint("stray_bytes", "Bytes received since start that nobody asked for"),
        OwnPoint("gap_violations", "Requests since start before the silence between frames was over"),
        OwnPoint("stray_gap_violations", "The same of frames that nobody asked for"),
        OwnPoint("turnaround_p50", "Half of the replies of the last minutes began sooner", _NUMBER, "ms"),
        OwnPoint("turnaround_p95", "95 % of the replies of the last minutes began sooner", _NUMBER, "ms"),
        OwnPoint("turnaround_max", "The slowest reply of the last minutes", _NUMBER, "ms"),
        OwnPoint("age_share", "The oldest value as a share of what was promised, in per cent", _NUMBER, "%"),
    )
)
"""What each line has."""

CONDITION = ("condition", "diagnosis")
"""Those of a line that tell what is wrong with it."""

OF_THE_GATEWAY: Mapping[str, OwnPoint] = _named(
    (
        OwnPoint("uptime", "Seconds since the core was started", _NUMBER, "s"),
        OwnPoint("journal", "Why the journal cannot be written; empty when it can", _TEXT),
    )
)
"""What the gateway itself has."""
