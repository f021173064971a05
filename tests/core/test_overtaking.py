"""A stop overtakes what its client and others asked before, on the way into the core too."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import Any, cast

import pytest

from gateway.bridge.api import API_VERSION
from gateway.bridge.messages import Call, Done, Hello, Response, RunCommand, WriteTag, pack
from gateway.core.events import Asked
from gateway.core.server import READ_AHEAD, Server
from gateway.core.shell import Shell
from gateway.tag import Outcome, Role, Verdict
from tests.core.test_broadcasting import site_with
from tests.core.world import OPERATOR, World, make_site

FLOOD = 1000


def setpoint(id: int, drive: str = "fan-1", ttl: float = 5.0) -> WriteTag:
    return WriteTag(id, f"{drive}.frequency_command", 20.0, OPERATOR, ttl, "")


def stop(id: int, drive: str = "fan-1", name: str = "stop") -> RunCommand:
    return RunCommand(id, drive, name, {}, OPERATOR, 5.0, "")


def outcome(world: World, id: int) -> Outcome:
    """What became of a request."""

    def found() -> Outcome | None:
        told = [one for one in world.told[world.session] if isinstance(one, Done) and one.id == id]
        return told[0].outcome if told else None

    return cast("Outcome", world.until(found, 10.0))


@pytest.mark.parametrize("stopped", [stop(1, "pump-2"), stop(1, "_north", "stop_all")])
def test_what_came_before_a_stop_does_not_follow_it(stopped: RunCommand) -> None:
    world = World(site_with(2, role=Role.OPERATOR))
    world.run(3.0)
    came = world.instant().mono
    world.run(0.05)
    world.feed(Asked(world.session, stopped, world.instant().mono))
    world.feed(Asked(world.session, setpoint(2, "pump-2"), came))
    before = outcome(world, 2)
    world.feed(Asked(world.session, setpoint(3, "pump-2"), world.instant().mono))
    assert (before.verdict, before.reason) == (Verdict.SUPERSEDED, "a stop took its place")
    assert outcome(world, 1).verdict is Verdict.CONFIRMED
    assert outcome(world, 3).verdict is Verdict.CONFIRMED
    told = [entry["outcome"]["verdict"] for entry in world.journal if entry["kind"] == "outcome"]
    assert told.count("superseded") == 1, "on record"


def test_a_stop_of_one_drive_takes_nothing_from_another() -> None:
    world = World(make_site(2))
    world.run(3.0)
    came = world.instant().mono
    world.run(0.05)
    world.feed(Asked(world.session, stop(1)))
    world.feed(Asked(world.session, setpoint(2, "fan-2"), came))
    assert outcome(world, 2).verdict is Verdict.CONFIRMED


def test_time_on_the_way_is_part_of_what_a_request_may_wait() -> None:
    world = World(make_site(1))
    world.run(3.0)
    world.feed(Asked(world.session, setpoint(1, ttl=0.5), world.instant().mono - 0.6))
    assert outcome(world, 1).verdict is Verdict.EXPIRED


class Counting:
    """A shell that notes what it is asked, and in which turn of the loop."""

    def __init__(self) -> None:
        self.core = self
        self.asked: list[tuple[int, Call]] = []
        self.turn = 0
        self.left = False

    def urgent(self, request: Call) -> bool:
        return isinstance(request, RunCommand)

    def join(self, name: str, ceiling: Role, deliver: Callable[[Response], None], section: Any) -> int:
        return 1

    def ask(self, session: int, request: Call, came: float = 0.0) -> None:
        self.asked.append((self.turn, request))

    def leave(self, session: int) -> None:
        self.left = True

    async def count_turns(self) -> None:
        while True:
            self.turn += 1
            await asyncio.sleep(0)


async def flooded(*requests: Call) -> Counting:
    """A shell after a client asked all this in one breath and left."""
    shell = Counting()
    server = Server(cast("Shell", shell))
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    turns = asyncio.create_task(shell.count_turns())
    server.adopt(ours, Role.ADMIN, {})
    data = b"".join(pack(one) for one in (Hello(API_VERSION, "test"), *requests))
    await asyncio.get_running_loop().sock_sendall(theirs, data)
    theirs.close()
    async with asyncio.timeout(20):
        while not shell.left:
            await asyncio.sleep(0)
    turns.cancel()
    return shell


async def test_a_stop_is_begun_long_before_a_thousand_writes_that_were_asked_before_it() -> None:
    shell = await flooded(*(setpoint(number) for number in range(FLOOD)), stop(FLOOD))
    order = [request.id for _, request in shell.asked]
    assert order.index(FLOOD) < 2 * FLOOD / READ_AHEAD
    assert sorted(order) == list(range(FLOOD + 1)), "nothing is lost when the client leaves"


async def test_however_much_is_asked_at_once_lines_have_their_turn_after_each_request() -> None:
    shell = await flooded(*(setpoint(number) for number in range(FLOOD)))
    turns = [turn for turn, _ in shell.asked]
    assert len(set(turns)) == len(turns) == FLOOD
    assert [request.id for _, request in shell.asked] == list(range(FLOOD))
