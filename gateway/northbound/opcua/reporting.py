"""Which changes a monitored item reports, and its queue (OPC 10000-4 sections 5.13.1 and 7.22.2). Pure."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from asyncua import ua

from gateway.northbound.opcua import plain

_OVERFLOW = 0x480
"""InfoType DataValue with the Overflow bit (OPC 10000-4 section 7.39.1)."""


@dataclass(slots=True)
class Rule:
    """What one item reports. ``deadband`` is absolute, in the unit of the value."""

    trigger: ua.DataChangeTrigger = ua.DataChangeTrigger.StatusValue
    deadband: float = 0.0
    discard_oldest: bool = True
    reported: ua.DataValue | None = None
    """The last value put into the queue: deadbands count from it, so that slow drift is seen."""

    def due(self, new: ua.DataValue) -> bool:
        """True when the value is to be reported. A change of status always is, whatever the deadband."""
        old = self.reported
        if old is None or old.StatusCode != new.StatusCode:
            return True
        if self.trigger == ua.DataChangeTrigger.Status:
            return False
        if (
            self.trigger == ua.DataChangeTrigger.StatusValueTimestamp
            and old.SourceTimestamp != new.SourceTimestamp
        ):
            return True
        return _differs(_content(old), _content(new), self.deadband)


def _content(value: ua.DataValue) -> object:
    return value.Value.Value if value.Value is not None else None


def _differs(old: object, new: object, deadband: float) -> bool:
    if deadband > 0 and isinstance(old, int | float) and isinstance(new, int | float):
        return abs(new - old) > deadband
    return old != new


def enqueue(
    queue: list[ua.MonitoredItemNotification],
    notification: ua.MonitoredItemNotification,
    size: int,
    *,
    discard_oldest: bool,
) -> None:
    """Add to an item's queue of at most ``size``; what was lost shows as the Overflow bit."""
    if len(queue) < size:
        queue.append(notification)
    elif size <= 1:
        queue[:] = [notification]
    elif discard_oldest:
        queue[:] = [_overflowed(queue[1]), *queue[2:], notification]
    else:
        queue[-1] = _overflowed(notification)


def _overflowed(notification: ua.MonitoredItemNotification) -> ua.MonitoredItemNotification:
    value = notification.Value
    code = value.StatusCode.value if value.StatusCode is not None else ua.StatusCodes.Good
    # A copy: the same DataValue stands in the node and in other items' queues.
    marked = dataclasses.replace(value, StatusCode=plain.status(code | _OVERFLOW))
    return ua.MonitoredItemNotification(ClientHandle=notification.ClientHandle, Value=marked)
