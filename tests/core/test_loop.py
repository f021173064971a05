"""The core's loop: exact timers, and what happens on a file ends the waiting."""

from __future__ import annotations

import os
import selectors
import time

from gateway.core.loop import SPIN, ExactSelector


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
