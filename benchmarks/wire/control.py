"""The emulator, seen from a benchmark."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from benchmarks.wire.settings import LineSettings

ROOT = Path(__file__).parents[2]


class Wire:
    """Emulated lines in a process of their own; use it as a context."""

    def __init__(self, lines: list[LineSettings]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.wire"],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.ports: dict[str, str] = self._ask(lines=[asdict(line) for line in lines])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(5)

    def count(self) -> None:
        """Begin a new count on all lines."""
        self._ask(count=True)

    def tally(self) -> dict[str, dict[str, Any]]:
        """What was counted, by line; see `benchmarks.wire.tally.Tally`."""
        tally: dict[str, dict[str, Any]] = self._ask(tally=True)
        return tally

    def silence(self, line: str, units: list[int]) -> None:
        """From now on these units of a line do not answer, and all others do."""
        self._ask(silent={line: units})

    def _ask(self, **asked: Any) -> Any:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError("the emulator ended")
        return json.loads(answer)
