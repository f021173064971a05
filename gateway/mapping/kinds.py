"""What the kind of a point says about it, unless its own keys say otherwise."""

from __future__ import annotations

from typing import NamedTuple

from gateway.mapping.profile import Access, Kind
from gateway.tag import Role


class Defaults(NamedTuple):
    """Access, least role to write (None: never written), and rate."""

    access: Access
    role: Role | None
    rate: str


KINDS: dict[Kind, Defaults] = {
    Kind.STATUS: Defaults(Access.READ, None, "normal"),
    Kind.MEASUREMENT: Defaults(Access.READ, None, "normal"),
    Kind.FAULT: Defaults(Access.READ, None, "normal"),
    Kind.COUNTER: Defaults(Access.READ, None, "slow"),
    Kind.SETPOINT: Defaults(Access.READ_WRITE, Role.OPERATOR, "normal"),
    Kind.COMMAND: Defaults(Access.READ_WRITE, Role.OPERATOR, "normal"),
    Kind.SWITCH: Defaults(Access.READ_WRITE, Role.OPERATOR, "normal"),
    Kind.PARAMETER: Defaults(Access.READ_WRITE, Role.ENGINEER, "slow"),
}
