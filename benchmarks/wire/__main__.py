"""The emulator's process: ``python -m benchmarks.wire``.

It takes one JSON object a line on standard input and answers each with one on standard output:
``{"lines": [settings, ...]}`` first, answered with the ports by name; then ``{"count": true}`` to begin a
count, ``{"tally": true}`` for what was counted, ``{"silent": {line: [units]}}``. The end of the input is
the end of it.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import select
import sys
import time
import tty
from typing import Any

from benchmarks.wire.line import WireLine
from benchmarks.wire.settings import LineSettings

SPIN = 120e-6
"""Seconds before an instant that are waited out by looking at the clock, on one line; shared by more, so that
the emulator leaves the processors to the gateway."""
PR_SET_TIMERSLACK = 29
CHUNK = 4096
INPUT = 0


class Emulator:
    """All lines, each on a pty."""

    def __init__(self, settings: list[LineSettings]) -> None:
        self.ports: dict[str, str] = {}
        self._lines: dict[int, WireLine] = {}
        for one in settings:
            ours, theirs = os.openpty()
            tty.setraw(theirs)
            os.set_blocking(ours, False)
            self._lines[ours] = WireLine(one)
            self.ports[one.name] = os.ttyname(theirs)

    def run(self) -> None:
        """Let time pass on all lines until the input ends."""
        watched = [INPUT, *self._lines]
        lines, spin = list(self._lines.items()), SPIN / len(self._lines)
        while True:
            fd, line = min(lines, key=lambda item: item[1].next_at)
            wait = line.next_at - time.monotonic()
            if wait <= 0:
                _hand_over(fd, line)
                continue
            ready, _, _ = select.select(watched, (), (), max(0.0, min(wait - spin, 1.0)))
            now = time.monotonic()
            for fd in ready:
                if fd == INPUT:
                    if not self._hear():
                        return
                else:
                    self._lines[fd].arrived(os.read(fd, CHUNK), now)

    def _hear(self) -> bool:
        """Carry out what is asked on standard input; False at its end."""
        text = os.read(INPUT, CHUNK)
        for asked in text.splitlines():
            print(json.dumps(self._answer(json.loads(asked))), flush=True)
        return bool(text)

    def _answer(self, asked: dict[str, Any]) -> Any:
        lines = {line.settings.name: line for line in self._lines.values()}
        if "count" in asked:
            for line in lines.values():
                line.count_anew()
        for name, units in asked.get("silent", {}).items():
            lines[name].settings.silent = units
        return {name: line.tally.report() for name, line in lines.items()} if "tally" in asked else {}


def _hand_over(fd: int, line: WireLine) -> None:
    with contextlib.suppress(BlockingIOError):  # nobody has the port open and reads: lost, as on a wire
        os.write(fd, line.due(time.monotonic()))


def main() -> None:
    """Set up the lines that standard input names, and run them."""
    ctypes.CDLL(None).prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)
    with contextlib.suppress(OSError):  # a wire does not wait; without the right to this, figures are worse
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    settings = [LineSettings(**one) for one in json.loads(sys.stdin.readline())["lines"]]
    emulator = Emulator(settings)
    print(json.dumps(emulator.ports), flush=True)
    emulator.run()


if __name__ == "__main__":
    main()
