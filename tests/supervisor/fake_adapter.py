"""Stands in for an adapter: ends with 75 when its core is gone, like the real ones.

Usage: fake_adapter.py NOTES BRIDGE_FD [deaf]; a deaf one neither notices nor ends on SIGTERM.
"""

import signal
import socket
import sys
from pathlib import Path


def note(path: Path, word: str) -> None:
    with path.open("a") as file:
        file.write(word + "\n")


def main() -> None:
    notes = Path(sys.argv[1])
    deaf = "deaf" in sys.argv
    handler = signal.SIG_IGN if deaf else lambda *_: (note(notes, "adapter stopped"), sys.exit(0))
    signal.signal(signal.SIGTERM, handler)
    link = socket.socket(fileno=int(sys.argv[2]))
    note(notes, "adapter started")
    while deaf:
        signal.pause()
    link.recv(1)
    sys.exit(75)


main()
