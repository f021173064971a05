"""Where the running core of a data folder is found."""

from __future__ import annotations

import fcntl
import hashlib
import os
import tempfile
from pathlib import Path

LOCK_NAME = "lock"


def lock_path(data: Path) -> Path:
    """The file whose lock says that a core owns this data folder."""
    return data / LOCK_NAME


def socket_path(data: Path) -> Path:
    """The socket of the core that owns ``data``; its name is a hash, since socket paths are short."""
    name = hashlib.sha256(str(data.resolve()).encode()).hexdigest()[:16]
    return runtime_folder() / f"{name}.sock"


def runtime_folder() -> Path:
    """The user's own folder for sockets; made with mode 0700 if it is not there.

    Raises:
        PermissionError: if somebody else owns it.
    """
    base = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(base) / "gateway" if base else Path(tempfile.gettempdir()) / f"gateway-{os.getuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder.stat().st_uid != os.getuid():
        raise PermissionError(f"{folder} belongs to somebody else (remove it, or set XDG_RUNTIME_DIR)")
    return folder


def running(data: Path) -> bool:
    """True when a core holds the lock of this data folder."""
    try:
        with lock_path(data).open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except FileNotFoundError:
        return False
    return False
