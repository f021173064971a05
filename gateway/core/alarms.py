"""What somebody has to look at: alarms that are raised, cleared and acknowledged. Pure.

An alarm stands until its cause is gone *and* somebody acknowledged it, in either order. What only happens
once (a drive restarted) has no cause that could go: it stands until it is acknowledged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from msgspec import structs

from gateway.bridge.api import Alarm
from gateway.core.guard import Ended, check_rights, refuse
from gateway.tag import Cause, Event, Instant, Origin, Outcome, Role, Verdict

RAISED, CLEARED, ACKNOWLEDGED = "alarm_raised", "alarm_cleared", "alarm_acknowledged"
"""Names of the events that tell of alarms; the journal says the same."""

Listener = Callable[[Alarm, Origin], None]
"""Told of each alarm that is acknowledged, and by whom."""


class Alarms:
    """All alarms that stand. Their subjects are drives, lines (``_north``) and the gateway (``_gateway``).

    Args:
        tell: passes an event on to the clients.
        record: appends to the journal.
    """

    def __init__(self, tell: Callable[[Event], None], record: Callable[[dict[str, Any]], int]) -> None:
        self._standing: dict[str, Alarm] = {}
        self._tell = tell
        self._record = record
        self._listeners: list[Listener] = []

    def restore(self, remembered: Iterable[Alarm], now: Instant) -> None:
        """Take up what stood when the gateway ended. Whether a cause is still there has to show anew: what
        was acknowledged is gone until then, what was not stands as something that happened."""
        for alarm in remembered:
            if not alarm.acknowledged:
                over = structs.replace(alarm, cleared=alarm.cleared or now.wall)
                self._standing[alarm.key] = over

    def listen(self, listener: Listener) -> None:
        """Be told of what is acknowledged."""
        self._listeners.append(listener)

    def standing(self) -> tuple[Alarm, ...]:
        """Every alarm that stands, the oldest first."""
        return tuple(self._standing.values())

    def get(self, subject: str, name: str) -> Alarm | None:
        """An alarm, if it stands."""
        return self._standing.get(key_of(subject, name))

    def raise_(self, subject: str, name: str, text: str, now: Instant, *, once: bool = False) -> bool:
        """The cause of an alarm is there; ``once``: something happened and is over. While the alarm stands
        with its cause, or unacknowledged, only its text changes, and nobody is told again; True if told."""
        key = key_of(subject, name)
        known = self._standing.get(key)
        if known is not None and (once or not known.cleared):
            self._standing[key] = structs.replace(known, text=text)
            return False
        cleared = now.wall if once else 0
        alarm = Alarm(key=key, subject=subject, name=name, text=text, raised=now.wall, cleared=cleared)
        self._standing[key] = alarm
        self._say(RAISED, alarm, now)
        return True

    def clear(self, subject: str, name: str, now: Instant) -> None:
        """The cause of an alarm is gone, if it was there."""
        alarm = self._standing.get(key_of(subject, name))
        if alarm is not None and not alarm.cleared:
            self._change(structs.replace(alarm, cleared=now.wall), CLEARED, now)

    def set(self, subject: str, name: str, text: str, now: Instant) -> None:
        """The cause is there while there is a text that says so, and gone with an empty one."""
        if text:
            self.raise_(subject, name, text, now)
        else:
            self.clear(subject, name, now)

    def acknowledge(self, key: str, origin: Origin, ceiling: Role, now: Instant) -> Outcome:
        """Somebody has seen an alarm; an operator may."""
        try:
            check_rights(Role.OPERATOR, origin, ceiling)
            alarm = self._find(key)
        except Ended as ended:
            return structs.replace(ended.outcome, asked=now.wall, done=now.wall)
        if not alarm.acknowledged:
            seen = structs.replace(alarm, acknowledged=now.wall, by=origin.who)
            self._change(seen, ACKNOWLEDGED, now, origin)
            for listener in self._listeners:
                listener(seen, origin)
        return Outcome(verdict=Verdict.CONFIRMED, reason=alarm.text, asked=now.wall, done=now.wall)

    def _find(self, key: str) -> Alarm:
        if key not in self._standing:
            raise refuse(
                Cause.UNKNOWN_ALARM, f"there is no alarm {key} (`gateway health` shows those there are)"
            )
        return self._standing[key]

    def _change(self, alarm: Alarm, what: str, now: Instant, origin: Origin | None = None) -> None:
        """Keep what an alarm has become; one that nothing holds any more is gone."""
        self._standing[alarm.key] = alarm
        if alarm.is_over:
            del self._standing[alarm.key]
        self._say(what, alarm, now, origin)

    def _say(self, what: str, alarm: Alarm, now: Instant, origin: Origin | None = None) -> None:
        """Into the journal, and to the clients."""
        by = {} if origin is None else {"by": origin}
        self._record({"kind": "alarm", "did": what.removeprefix("alarm_"), "alarm": alarm, **by})
        whom = f" (acknowledged by {alarm.by})" if what == ACKNOWLEDGED else ""
        self._tell(
            Event(time=now.wall, drive=alarm.subject, name=what, text=alarm.text + whom, alarm=alarm.key)
        )


def key_of(subject: str, name: str) -> str:
    """What an alarm is acknowledged by: ``fan-1.restarted``."""
    return f"{subject}.{name}"
