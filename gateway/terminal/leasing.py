"""Commands of the command line under the lease of their drive.

A command that is over holds nothing: what it acquired it releases, so that others may go on, and what it set
moving is made good unless somebody acquires the lease. With ``--hold`` it stays instead.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from functools import partial

import typer

from gateway.bridge.api import Bridge, ControlState, DriveInfo, LeaseAct, OwnerInfo, PointInfo
from gateway.tag import Origin, Outcome, Verdict, own_name
from gateway.terminal.errors import UsageError
from gateway.terminal.output import tell

Work = Callable[[], Awaitable[Outcome]]
"""Asks for a write or command."""

SHARE = 0.3
"""A lease is renewed after this share of its ttl."""


def note(text: str) -> None:
    """A remark for people, apart from the answer."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


class Hand:
    """The hand of this command on one drive.

    Args:
        origin: who runs the command.
    """

    def __init__(self, bridge: Bridge, drive: DriveInfo, origin: Origin) -> None:
        self._bridge = bridge
        self._drive = drive
        self._origin = origin
        self._had = False

    @property
    def _needed(self) -> bool:
        return self._drive.control.lease != "off"

    async def carry_out(self, work: Work) -> Outcome:
        """The outcome of a write or command; while it is under way, the lease is renewed. Where the site
        wants the lease acquired first, that is done."""
        self._had = await self._is_mine()
        if self._drive.control.lease == "required" and not self._had:
            acquired = await self._lease(LeaseAct.ACQUIRE)
            if acquired.verdict is not Verdict.CONFIRMED:
                return acquired
        async with self._renewing():
            return await work()

    async def let_go(self) -> None:
        """Release what was acquired, and say what follows."""
        if not self._needed or self._had or not await self._is_mine():
            return
        outcome = await self._lease(LeaseAct.RELEASE)
        if outcome.reason != "released":
            note(f"{self._drive.name}: {outcome.reason} (--hold stays and renews the lease)")

    async def hold(self) -> bool:
        """Stay and renew until Ctrl-C, then release. False if the lease was lost before."""
        if not self._needed:
            return True
        note(f"{self._drive.name} is held; Ctrl-C releases it")
        interrupted = asyncio.Event()
        with _on_interrupt(interrupted):
            while not interrupted.is_set():
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(interrupted.wait(), SHARE * self._drive.control.ttl)
                outcome = await self._lease(LeaseAct.RENEW)
                if outcome.verdict is not Verdict.CONFIRMED:
                    note(f"{self._drive.name} is not held any more: {outcome.reason}")
                    return False
        self._had = False
        await self.let_go()
        return True

    @contextlib.asynccontextmanager
    async def _renewing(self) -> AsyncIterator[None]:
        task = asyncio.create_task(self._renew())
        try:
            yield
        finally:
            task.cancel()

    async def _renew(self) -> None:
        while self._needed:
            await asyncio.sleep(SHARE * self._drive.control.ttl)
            if await self._is_mine():
                await self._lease(LeaseAct.RENEW)

    async def _is_mine(self) -> bool:
        states = await self._bridge.controls() if self._needed else ()
        return any(state.drive == self._drive.name and mine(state, self._origin) for state in states)

    async def _lease(self, act: LeaseAct) -> Outcome:
        return await self._bridge.lease(self._drive.name, act, self._origin)


class Hands:
    """The hands of this command on all drives of a line."""

    def __init__(self, hands: Sequence[Hand]) -> None:
        self._hands = hands

    async def carry_out(self, work: Work) -> Outcome:
        """As `Hand.carry_out`."""
        for hand in self._hands:
            work = partial(hand.carry_out, work)
        return await work()

    async def let_go(self) -> None:
        """As `Hand.let_go`."""
        for hand in self._hands:
            await hand.let_go()

    async def hold(self) -> bool:
        """`hand_on` lets nobody stay on several drives at once."""
        return True


def hand_on(bridge: Bridge, found: OwnerInfo | None, origin: Origin, hold: bool) -> Hand | Hands:
    """The hand on a drive, on all drives of a line, or on nothing, where there is nothing of the name.

    Raises:
        UsageError: if it should stay on several drives.
    """
    if isinstance(found, DriveInfo):
        return Hand(bridge, found, origin)
    if found is None:
        return Hands([])
    if hold:
        raise UsageError("--hold is for one drive; acquire the others by name (gateway lease)")
    drives = [drive for drive in bridge.catalogue.drives if own_name(drive.line) == found.name]
    return Hands([Hand(bridge, drive, origin) for drive in drives])


async def finish_under(
    hand: Hand | Hands, asked: str, work: Work, hold: bool, as_json: bool, point: PointInfo | None = None
) -> None:
    """Carry out a write or command, print what became of it, then hold the lease or release it.

    Raises:
        typer.Exit: with 1, unless it was confirmed and the lease not lost.
    """
    outcome = await hand.carry_out(work)
    tell(asked, outcome, as_json, point)
    done = outcome.verdict is Verdict.CONFIRMED
    if done and hold:
        done = await hand.hold()
    else:
        await hand.let_go()
    if not done:
        raise typer.Exit(1)


def mine(state: ControlState, origin: Origin) -> bool:
    """True when this user of the command line holds the lease."""
    holder = state.holder
    return holder is not None and (holder.through, holder.who) == (origin.through, origin.who)


@contextlib.contextmanager
def _on_interrupt(event: asyncio.Event) -> Iterator[None]:
    """Set the event on Ctrl-C and SIGTERM, in place of what else they do."""
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, event.set)
    try:
        yield
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
