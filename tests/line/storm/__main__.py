"""``python -m tests.line.storm``: so many transactions in scenes drawn from a seed, and what was wrong."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

from tests.line.storm.storm import Storm, scene_of

PER_SCENE = 5000


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--transactions", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scene", type=int, help="play this one scene only, and show it")
    args = parser.parse_args()
    if args.scene is not None:
        print(scene_of(args.scene))
    counts: Counter[str] = Counter()
    done, good, began = 0, 0, time.monotonic()
    seeds = iter([args.scene] if args.scene is not None else range(args.seed * 1_000_000, 2**60))
    while done < args.transactions and (seed := next(seeds, None)) is not None:
        report = Storm(scene_of(seed)).run(min(PER_SCENE, args.transactions - done))
        done, good = done + report.transactions, good + report.good
        counts += report.counts
        for line in report.wrong[:3]:
            print(line, flush=True)
    took = time.monotonic() - began
    print(f"{done} transactions, {good} good reads, {done / took:.0f} transactions a second")
    for name, number in sorted(counts.items()):
        print(f"  {name}: {number}")
    return 1 if any(name.startswith("WRONG") for name in counts) else 0


if __name__ == "__main__":
    sys.exit(main())
