"""Is a drive fit to be written to, whatever is written? Asked by every write but a stop. Pure."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from gateway.core.commloss import comm_loss_settled
from gateway.core.drive import Drive
from gateway.core.identity import identified
from gateway.core.procedure import Effect
from gateway.core.store import Store


def fit(drive: Drive, store: Store, now: float, point: str = "") -> Generator[Effect, Any, None]:
    """A part of a procedure: go on only if the drive is of its model (S4), and does what the site demands
    when the line dies (H9); the ``point`` that decides the latter may be mended.

    Raises:
        Ended: if it is not fit, or nobody can tell.
    """
    yield from identified(drive, store, now)
    if point not in drive.profile.serial.comm_loss.names:
        yield from comm_loss_settled(drive, store, now)
