"""Stands in for the core: says that it is ready, notes each header it is given, keeps the sockets.

Usage: fake_core.py NOTES CONTROL_FD [EXIT_CODE]; with an exit code it ends at once.
"""

import json
import signal
import socket
import sys
from pathlib import Path


def note(path: Path, word: str) -> None:
    with path.open("a") as file:
        file.write(word + "\n")


def main() -> None:
    notes = Path(sys.argv[1])
    if len(sys.argv) > 3:
        sys.exit(int(sys.argv[3]))
    signal.signal(signal.SIGTERM, lambda *_: (note(notes, "core stopped"), sys.exit(0)))
    control = socket.socket(fileno=int(sys.argv[2]))
    control.send(json.dumps({"ready": True}).encode() + b"\n")
    kept = []
    while True:
        message, fds, _, _ = socket.recv_fds(control, 4096, 1)
        if not message:
            return
        kept += fds
        note(notes, f"given {message.decode().strip()}")


main()
