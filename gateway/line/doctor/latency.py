"""Does the adapter hand over what it received only when its timer fires? Pure.

FTDI's chips collect what comes in and pass it on every 16 ms (their application note AN232B-04), unless the
driver asks for less. Then the end of a reply is seen on a grid of 16 ms: a fixed one, or one that begins with
the request, as the driver has it. On a sound line it is seen when it is there, which depends on its length: a
drive that needs the same time for replies of all lengths has none of its bytes held back. Where all replies
are of one length, the moments of the requests have to tell.

A busy host delays some arrivals by milliseconds. So it is counted how many fall into one narrow window.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from statistics import median

from gateway.line.doctor.chart import Arrival

PERIOD = 0.016
"""Seconds of the timer's factory setting."""
WINDOW = 0.003
"""Seconds that count as the same moment."""
CHANCE = WINDOW / PERIOD
"""Share of all arrivals that falls into such a window by chance."""
REPLIES = 40
"""Replies that are looked at, at least."""
ALIKE = 16
"""The same where all are of one length: of those the ones whose requests did not wait for another reply."""
MOST = 0.8
"""So many are nearly all."""
FEW = 0.6
"""The lengths of the replies, or the moments of the requests, are not on the grid if no more of them are."""
SURE = 3.0
"""Seven standard deviations of a share, times the root of the number that it is a share of."""


def latency_timer(arrivals: Sequence[Arrival]) -> dict[str, float]:
    """What speaks for a timer; empty when nothing does."""
    if len(arrivals) < REPLIES:
        return {}
    if densest(one.duration % PERIOD for one in arrivals) > FEW:
        return _alike(_on_their_own(arrivals))
    if densest(_unevenness(arrivals), wraps=False) > MOST:
        return {}
    fixed = densest(one.at % PERIOD for one in arrivals)
    relative = densest(one.after % PERIOD for one in arrivals)
    asked = densest((one.at - one.after) % PERIOD for one in arrivals)
    enough = MOST if asked > FEW else CHANCE + SURE / math.sqrt(len(arrivals))
    if fixed < enough and relative < MOST:
        return {}
    return _evidence(arrivals, max(fixed, relative))


def _evidence(arrivals: Sequence[Arrival], share: float) -> dict[str, float]:
    return {"replies": len(arrivals), "on_grid": round(share, 2), "milliseconds": 1000 * PERIOD}


def _alike(arrivals: Sequence[Arrival]) -> dict[str, float]:
    """What speaks for a timer where all replies are of one length: from a sound line they come as far apart
    as they are asked for, so that they are on no grid if their requests are not."""
    if len(arrivals) < ALIKE or densest((one.at - one.after) % PERIOD for one in arrivals) > FEW:
        return {}
    share = densest(one.at % PERIOD for one in arrivals)
    return _evidence(arrivals, share) if share >= MOST else {}


def _on_their_own(arrivals: Sequence[Arrival]) -> list[Arrival]:
    """The replies to requests that waited for their time. Those that only waited for the reply before them,
    and then for as long as a request takes, are on its grid."""
    pauses = [two.at - two.after - one.at for one, two in pairwise(arrivals)]
    least = min(pauses, default=0.0)
    if least > 2 * min(one.duration for one in arrivals):
        return list(arrivals)
    return [one for one, pause in zip(arrivals[1:], pauses, strict=True) if pause > least + WINDOW]


def _unevenness(arrivals: Sequence[Arrival]) -> list[float]:
    """By how much each reply began later than is usual for its unit."""
    turnarounds: dict[int, list[float]] = {}
    for one in arrivals:
        turnarounds.setdefault(one.unit, []).append(one.after - one.duration)
    usual = {unit: median(all_of_it) for unit, all_of_it in turnarounds.items()}
    return [one.after - one.duration - usual[one.unit] for one in arrivals]


def densest(times: Iterable[float], wraps: bool = True) -> float:
    """The share of these times in the window that holds most of them; ``wraps``: they are moments of the
    period, whose end is its beginning again."""
    ordered = sorted(times)
    unrolled = [*ordered, *(time + PERIOD for time in ordered)] if wraps else ordered
    most = begin = 0
    for end, time in enumerate(unrolled):
        while time - unrolled[begin] > WINDOW:
            begin += 1
        most = max(most, end - begin + 1)
    return min(most, len(ordered)) / len(ordered)
