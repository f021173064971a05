"""Runs a `Line` on an event loop: carries out what it decides about the port, passes on the rest.

Everything happens on one loop. Timers are as fine as the loop's selector: run it on a
`selectors.SelectSelector`, since epoll rounds time-outs up to whole milliseconds.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Sequence

from gateway.line.interface import Action, ClosePort, Job, OpenPort, Transmit, Want
from gateway.line.line import Line
from gateway.line.port import Port

SPIN = 150e-6
"""Seconds before a timer's end that are waited out by looking at the clock: sleeping wakes too late."""

OnActions = Callable[[Sequence[Action]], None]
PortFactory = Callable[[], Awaitable[Port]]


class LineMaster:
    """A line at work.

    ``on_actions`` gets every list of actions after the master has carried out its own part (opening,
    closing, transmitting), so that no time on the wire is lost to it. It is called with an empty list too
    when the port came or went, so that `Line.is_open` can be looked at.
    """

    def __init__(
        self,
        line: Line,
        open_port: PortFactory,
        on_actions: OnActions,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.line = line
        self._open_port = open_port
        self._on_actions = on_actions
        self._clock = clock
        self._port: Port | None = None
        self._opening: asyncio.Task[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._armed_for: float | None = None

    def start(self) -> None:
        """Open the port and begin. Must be called on the running loop."""
        self._perform(self.line.start(self._clock()))

    def stop(self) -> None:
        """End what is going on, tell every job, close the port."""
        self._perform(self.line.stop(self._clock()))

    def ask(self, job: Job) -> None:
        """Ask for one request. Raises `ValueError` when its unit cannot take it."""
        self._perform(self.line.ask(job, self._clock()))

    def withdraw(self, job_id: int) -> bool:
        """Forget a job; True when it was still waiting, and then nothing more is told of it."""
        withdrawn = self.line.withdraw(job_id, self._clock())
        self._arm()
        return withdrawn

    def demand(self, wants: Sequence[Want]) -> None:
        """Replace everything that is wanted. Raises `ValueError` when a want can never be met."""
        self._perform(self.line.demand(wants, self._clock()))

    def _perform(self, actions: list[Action]) -> None:
        """Carry out the port's part, arm the timer, pass everything on."""
        failure = ""
        for action in actions:
            match action:
                case Transmit(data=data):
                    failure = self._write(data) or failure
                case OpenPort():
                    self._opening = asyncio.get_running_loop().create_task(self._open())
                case ClosePort():
                    self._close()
                case _:
                    pass
        self._arm()
        self._on_actions(actions)
        if failure:
            self._lost(failure)

    def _write(self, data: bytes) -> str:
        """Why the bytes could not be written; empty when they were."""
        if self._port is None:
            return "the port is closed"
        try:
            self._port.write(data)
        except OSError as error:
            return str(error)
        return ""

    async def _open(self) -> None:
        try:
            port = await self._open_port()
        except OSError as error:
            self._perform(self.line.port_lost(str(error), self._clock()))
            return
        self._opening, self._port = None, port
        port.attach(self._received, self._lost)
        self._perform(self.line.port_opened(self._clock()))

    def _close(self) -> None:
        if self._opening is not None:
            self._opening.cancel()
            self._opening = None
        if self._port is not None:
            self._port.close()
            self._port = None

    def _received(self, data: bytes) -> None:
        self._perform(self.line.received(data, self._clock()))

    def _lost(self, reason: str) -> None:
        if self._port is None:
            return
        self._close()
        self._perform(self.line.port_lost(reason, self._clock()))

    def _arm(self) -> None:
        """One timer, for the line's next instant."""
        wake = self.line.wake()
        if wake == self._armed_for:
            return
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._armed_for = wake
        if wake is not None:
            wait = max(0.0, wake - self._clock() - SPIN)
            self._timer = asyncio.get_running_loop().call_later(wait, self._fire, wake)

    def _fire(self, wake: float) -> None:
        self._timer, self._armed_for = None, None
        while (now := self._clock()) < wake:
            if wake - now > SPIN:
                self._arm()
                return
        self._perform(self.line.tick(now))
