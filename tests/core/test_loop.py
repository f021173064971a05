"""The core's loop: exact timers, and what happens on a file ends the waiting."""

from __future__ import annotations

import asyncio
import os
import selectors
import struct
import time
from pathlib import Path

import pytest

import gateway.core.loop as loop_module
from gateway.core.loop import SPIN, ExactLoop, ExactSelector, stay_awake
from gateway.line.port import Prompt


def test_waiting_ends_at_the_instant_and_never_before() -> None:
    selector = ExactSelector()
    for seconds in (0.0, SPIN / 2, 5 * SPIN):
        for _ in range(20):
            began = time.monotonic()
            assert selector.select(seconds) == []
            assert time.monotonic() - began >= seconds


def test_the_end_of_waiting_is_looked_for_and_not_slept_over() -> None:
    late = []
    selector = ExactSelector()
    for _ in range(50):
        began = time.monotonic()
        selector.select(0.002)
        late.append(time.monotonic() - began - 0.002)
    assert min(late) < 20e-6, "epoll would end a millisecond late"


def test_what_comes_in_while_the_clock_is_watched_ends_the_waiting() -> None:
    read, write = os.pipe()
    try:
        selector = ExactSelector()
        selector.register(read, selectors.EVENT_READ)
        os.write(write, b"x")
        for seconds in (SPIN / 2, 10.0, None):
            [(key, events)] = selector.select(seconds)
            assert (key.fd, events) == (read, selectors.EVENT_READ)
    finally:
        os.close(read)
        os.close(write)


def test_a_file_is_read_as_soon_as_the_loop_wakes() -> None:
    """What else is ready has its turn first, and does not make the bytes look younger than they are."""
    read, write = os.pipe()
    order: list[str] = []

    async def main() -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, Prompt)
        loop.add_reader(read, lambda: order.append("turn"))
        loop.read_at_once(read, lambda: order.append(os.read(read, 9).decode()))
        loop.call_soon(lambda: (os.write(write, b"bytes"), loop.call_soon(order.append, "else")))
        while "turn" not in order:
            await asyncio.sleep(0)
        loop.read_at_once(read, None)
        loop.remove_reader(read)

    try:
        with asyncio.Runner(loop_factory=ExactLoop) as runner:
            runner.run(main())
        assert order.index("bytes") < order.index("turn")
    finally:
        os.close(read)
        os.close(write)


def test_the_processors_are_kept_awake_only_where_that_is_allowed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    demand, driver = tmp_path / "demand", tmp_path / "driver"
    monkeypatch.setattr(loop_module, "WAKING", demand)
    monkeypatch.setattr(loop_module, "IDLE_DRIVER", driver)
    assert not stay_awake(), "no such file: nothing is kept"
    for name, asked in (("", 10), ("intel_idle\n", 10), ("haltpoll\n", 0)):
        demand.write_bytes(b"")
        if name:
            driver.write_text(name)
        assert stay_awake()
        assert struct.unpack("i", demand.read_bytes()) == (asked,)
