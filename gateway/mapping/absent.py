"""Names that a profile knows and a drive does not have: meant for all drives, or left out by its settings."""

from __future__ import annotations

from gateway.mapping.profile import Broadcast
from gateway.mapping.site import DriveConfig

FOR_ALL = (
    "it goes to all drives of a line at once, so it is asked of the line, whose `broadcast` says who may"
)
"""Why nothing of a broadcast layout can be asked of one drive."""


def why_absent(config: DriveConfig, name: str) -> str:
    """Why a drive has no such point or command; empty when its profile does not know it either."""
    broadcast = config.profile.broadcast
    if broadcast is not None and name in members(broadcast):
        return FOR_ALL
    if name in config.ruled_out:
        return (
            f"the settings of {config.name} leave it out ({config.ruled_out[name] or 'it leans on others'})"
        )
    return ""


def members(broadcast: Broadcast) -> list[str]:
    """The points and commands of a broadcast layout."""
    return [*broadcast.points, *broadcast.commands]
