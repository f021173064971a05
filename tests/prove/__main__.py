"""``python -m tests.prove``: worlds from seeds, one of them again, or the faults planted by hand."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from pathlib import Path

from tests.prove import plants, proof
from tests.prove.box import Box
from tests.prove.scene import MUCH, in_words, scene_of
from tests.prove.shrink import shrunk


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--first", type=int, default=1_000, help="the first seed")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--report", type=Path, help="write the report here")
    parser.add_argument(
        "--seed", type=int, help="play this one world, and look for the shortest that fails alike"
    )
    parser.add_argument("--much", choices=sorted(MUCH), default="")
    parser.add_argument("--plants", action="store_true", help="search for the faults planted by hand")
    args = parser.parse_args()
    logging.disable()
    if args.seed is not None:
        return again(args.seed, args.much)
    if args.plants:
        return plants.main()
    tally = proof.prove(args.minutes, args.first, args.workers)
    if args.report is not None:
        proof.write(args.report, tally, args.first, proof.found_plants())
    speed = tally.line_seconds / tally.world_cpu
    sys.stdout.write(f"{tally.worlds.total()} worlds, {tally.line_seconds:.0f} line-seconds, {speed:.0f}/s; ")
    sys.stdout.write(f"{tally.transactions} transactions; {len(tally.wrong)} violations\n")
    return 1 if tally.wrong else 0


def again(seed: int, much: str) -> int:
    """One world; if it fails, the shortest found that fails alike."""
    scene = scene_of(seed, much)
    report = Box(scene).run()
    sys.stdout.write(f"trace {report.trace}, {report.line_seconds:.0f} line-seconds\n")
    if not report.wrong:
        return 0
    short = shrunk(scene, report)
    end = Box(short).run()
    for text in (*in_words(short), *(str(v) for v in report.wrong[:1]), "shrunk:", *map(str, end.wrong[:3])):
        sys.stdout.write(f"{text}\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
