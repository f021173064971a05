"""The reasons for which a drive refuses a request."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

from gateway.mapping.profile import ErrorMeaning

Reason = Literal["illegal_function", "illegal_address", "illegal_count", "illegal_value", "locked"]
"""The names that profiles give to error codes."""

STANDARD: Mapping[Reason, int] = MappingProxyType(
    {
        "illegal_function": 0x01,
        "illegal_address": 0x02,
        "illegal_count": 0x03,
        "illegal_value": 0x03,
        "locked": 0x04,
    }
)
"""What a drive answers whose profile has no code for the reason (Modbus application protocol, section 7)."""


class RefusalError(Exception):
    """A request that the drive understands and does not carry out."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(reason)
        self.reason: Reason = reason


def code_of(reason: Reason, errors: Mapping[int, ErrorMeaning]) -> int:
    """The drive's code for a reason, the lowest where it has several."""
    return min((code for code, meaning in errors.items() if meaning.name == reason), default=STANDARD[reason])
