"""The lock that makes a core the only one on its data folder. Shell."""

from __future__ import annotations

import contextlib
import fcntl
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from gateway.bridge.api import BridgeError
from gateway.bridge.place import lock_path

TRIES = 5
TRY_SECONDS = 0.05
"""`gateway.bridge.place.running` looks at the lock by holding it for a moment."""


@contextlib.contextmanager
def data_lock(data: Path) -> Iterator[None]:
    """Hold the data folder.

    Raises:
        BridgeError: if another core holds it, or it cannot be written.
    """
    try:
        data.mkdir(parents=True, exist_ok=True)
        file = _opened(lock_path(data))
    except OSError as error:
        raise BridgeError(
            f"{data} cannot be used: {error.strerror} (give `data:` a folder of yours)"
        ) from error
    with file:
        for attempt in range(TRIES):
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if attempt == TRIES - 1:
                    reason = (
                        f"another gateway runs on {data} (stop it, or give this one its own `data:` folder)"
                    )
                    raise BridgeError(reason) from None
                time.sleep(TRY_SECONDS)
        yield


def _opened(path: Path) -> IO[bytes]:
    """The file to lock. On a disk that became read-only, one that is there will do: drives can still be
    watched and stopped (safety.md R2)."""
    try:
        return path.open("ab")
    except OSError:
        if not path.exists():
            raise
        return path.open("rb")
