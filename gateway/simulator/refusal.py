"""The reasons for which a drive refuses a request."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from gateway.mapping.profile import ErrorMeaning

STANDARD: Mapping[str, int] = MappingProxyType(
    {
        "illegal_function": 0x01,
        "illegal_address": 0x02,
        "illegal_count": 0x03,
        "illegal_value": 0x03,
        "locked": 0x04,
        "undervoltage": 0x04,
        "busy": 0x06,
    }
)
"""What a drive answers whose profile has no code for the reason (Modbus application protocol, section 7).
The reasons are the names that profiles give to error codes."""


class RefusalError(Exception):
    """A request that the drive understands and does not carry out."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


def code_of(reason: str, errors: Mapping[int, ErrorMeaning]) -> int:
    """The drive's code for a reason, the lowest where it has several."""
    return min((code for code, meaning in errors.items() if meaning.name == reason), default=STANDARD[reason])
