"""The alarms that stand, as the journal remembers them. Pure.

The kind of entry is ``alarm``: each tells the whole of an alarm after a change.
"""

from __future__ import annotations

import msgspec
from msgspec import field

from gateway.bridge.api import Alarm
from gateway.core.chain import Entry


class Standing(msgspec.Struct, kw_only=True):
    """By what they are acknowledged by."""

    alarms: dict[str, Alarm] = field(default_factory=dict)

    def fold(self, entry: Entry) -> None:
        """Take in one entry of the journal."""
        if entry["kind"] != "alarm":
            return
        alarm = msgspec.convert(entry["alarm"], Alarm)
        self.alarms[alarm.key] = alarm
        if alarm.is_over:
            del self.alarms[alarm.key]
