"""What the programs of a gateway take of the processors."""

from __future__ import annotations

import time
from pathlib import Path


class Cpu:
    """Counts from its making on, for a process and its children."""

    def __init__(self, process: int) -> None:
        self._process = process
        self._began = time.monotonic()
        self._before = self._used()

    def per_cent(self) -> dict[str, float]:
        """Per program, in per cent of one processor."""
        took = time.monotonic() - self._began
        used = self._used()
        return {name: round(100 * (used[name] - self._before.get(name, 0.0)) / took, 1) for name in used}

    def _used(self) -> dict[str, float]:
        family = [self._process, *children(self._process)]
        return {name: seconds for process in family if (found := _look(process)) for name, seconds in [found]}


def children(process: int) -> list[int]:
    """The numbers of a process's children."""
    text = Path(f"/proc/{process}/task/{process}/children").read_text(encoding="ascii")
    return [int(number) for number in text.split()]


def _look(process: int) -> tuple[str, float] | None:
    """Name of a process, and the processor seconds that its threads have taken."""
    try:
        line = Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
        threads = list(Path(f"/proc/{process}/task").glob("*/schedstat"))
        took = sum(int(thread.read_text(encoding="ascii").split()[0]) for thread in threads) / 1e9
    except OSError:
        return None
    module = next((word.decode() for word in line if word.startswith(b"gateway.")), "supervisor")
    return module.removeprefix("gateway.").removeprefix("northbound."), took
