"""A child process that dies with us, however we die."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import os
import signal
import subprocess
from collections.abc import Callable, Sequence

PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None, use_errno=True)  # loaded here: between fork and exec nothing may be loaded


def _lifeline(parent: int) -> Callable[[], None]:
    """What a child does between fork and exec: ask the kernel to be killed when its parent dies."""

    def tie() -> None:
        _libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the parent died before the kernel knew of our wish
            os._exit(1)

    return tie


class Child:
    """A running program. Start it in the main thread: the kernel's death signal comes when the
    *thread* that forked ends.

    It leads a process group of its own, so that a Ctrl-C in the terminal reaches only the supervisor,
    which then stops everything in order. It has no standard input, and its standard output is dropped.
    """

    def __init__(self, argv: Sequence[str], keep: Sequence[int] = (), log: int | None = None) -> None:
        """Start ``argv``; ``keep`` are file descriptors that it inherits, ``log`` becomes its standard
        error (None: ours).

        Raises:
            OSError: if it cannot be started.
        """
        self._loop = asyncio.get_running_loop()
        self._gone = asyncio.Event()
        self.started = self._loop.time()
        self._process = subprocess.Popen(
            argv,
            pass_fds=keep,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
            process_group=0,
            preexec_fn=_lifeline(os.getpid()),  # noqa: PLW1509 - no thread of ours forks or holds locks
        )
        self._pidfd = os.pidfd_open(self._process.pid)
        self._loop.add_reader(self._pidfd, self._reap)

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def lived(self) -> float:
        """Seconds since it was started."""
        return self._loop.time() - self.started

    async def wait(self) -> int:
        """Its exit code, once it has ended; minus the signal's number if one killed it."""
        await self._gone.wait()
        return self._process.wait()

    async def stop(self, grace: float) -> None:
        """Ask it to end (SIGTERM); kill it if it has not done so within ``grace`` seconds."""
        self._send(signal.SIGTERM)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(grace):
                await self._gone.wait()
                return
        self._send(signal.SIGKILL)
        await self._gone.wait()

    def _send(self, number: signal.Signals) -> None:
        if not self._gone.is_set():
            self._process.send_signal(number)

    def _reap(self) -> None:
        self._loop.remove_reader(self._pidfd)
        os.close(self._pidfd)
        self._process.wait()
        self._gone.set()
