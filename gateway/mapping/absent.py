"""Names that a profile knows and a drive does not have: meant for all drives, or left out by its settings."""

from __future__ import annotations

from gateway.mapping.profile import Broadcast
from gateway.mapping.site import DriveConfig

NOT_SENT = "it goes to all drives of a line at once, and this version sends no broadcasts"
"""Why nothing of a broadcast layout can be used."""


def why_absent(config: DriveConfig, name: str) -> str:
    """Why a drive has no such point or command; empty when its profile does not know it either."""
    broadcast = config.profile.broadcast
    if broadcast is not None and name in members(broadcast):
        return NOT_SENT
    if name in config.ruled_out:
        return (
            f"the settings of {config.name} leave it out ({config.ruled_out[name] or 'it leans on others'})"
        )
    return ""


def members(broadcast: Broadcast) -> list[str]:
    """The points and commands of a broadcast layout."""
    return [*broadcast.points, *broadcast.commands]
