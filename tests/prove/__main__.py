"""``python -m tests.prove``: worlds from seeds, one of them again, or the faults planted by hand."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from pathlib import Path

from tests.prove import plants, proof, report
from tests.prove.box import Box
from tests.prove.scene import MUCH, scene_of
from tests.prove.shrink import shrunk, told


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
    parser.add_argument("--only", nargs="+", default=(), choices=list(plants.PLANTS), help="of these")
    args = parser.parse_args()
    logging.disable()
    if args.seed is not None:
        return again(args.seed, args.much)
    if args.plants:
        return plants.main(args.only)

    def written(tally: proof.Tally) -> None:
        if args.report is not None:
            report.write(args.report, tally)

    tally = proof.prove(args.minutes, args.first, args.workers, written)
    speed = tally.line_seconds / max(tally.world_cpu, 1e-9)
    sys.stdout.write(f"{tally.worlds.total()} worlds, {tally.line_seconds:.0f} line-seconds, {speed:.0f}/s; ")
    sys.stdout.write(f"{tally.transactions} transactions; {tally.crashes} crashes; {tally.hostile} hostile; ")
    sys.stdout.write(f"{len(tally.wrong)} violations; plants not found: {tally.missed or 'none'}\n")
    return 1 if tally.wrong or tally.missed else 0


def again(seed: int, much: str) -> int:
    """One world; if it fails, the shortest found that fails alike."""
    scene = scene_of(seed, much)
    first = Box(scene).run()
    sys.stdout.write(f"trace {first.trace}, {first.line_seconds:.0f} line-seconds\n")
    if not first.wrong:
        return 0
    sys.stdout.writelines(f"{text}\n" for text in told(scene, first, shrunk(scene, first), much))
    return 1


if __name__ == "__main__":
    sys.exit(main())
