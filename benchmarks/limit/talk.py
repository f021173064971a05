"""How a benchmark talks with its client processes: a JSON object a line, either way."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

ROOT = Path(__file__).parents[2]


class Client:
    """A client of the gateway, in a process of its own; use it as a context."""

    def __init__(self, module: str, **settings: Any) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"benchmarks.limit.{module}", json.dumps(settings)],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait(5)

    def hear(self) -> Any:
        """The next thing that it says. Raises `RuntimeError` when it ended."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError("a client process ended")
        return json.loads(line)

    def ask(self, **asked: Any) -> Any:
        """Ask it for something, and wait for the answer."""
        self.tell(**asked)
        return self.hear()

    def tell(self, **asked: Any) -> None:
        """Ask it for something; `hear` brings the answer."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()


def settings() -> dict[str, Any]:
    """In a client process: what it was started with."""
    given: dict[str, Any] = json.loads(sys.argv[1])
    return given


def say(message: Any) -> None:
    """In a client process: answer."""
    print(json.dumps(message), flush=True)


async def asked() -> AsyncIterator[dict[str, Any]]:
    """In a client process: what is asked, until the benchmark has ended."""
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(
        lambda: asyncio.StreamReaderProtocol(reader), sys.stdin
    )
    while line := await reader.readline():
        yield json.loads(line)
