"""How much of the physical limit of its lines the whole gateway uses, and how soon a write is on the wire.

Run: ``python benchmarks/line_limit.py [SCENARIO ...] [--seconds 30] [--repeat 3] [--json]``. A scenario is
named by words of its name. Exit code 1 when something to be reached was not.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path


def main() -> int:
    """Measure, print, and tell by the exit code whether all was reached."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # run as a file, it does not find its parts
    from benchmarks.limit.report import heading, line
    from benchmarks.limit.scenarios import SCENARIOS

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenario", nargs="*", help="part of the name of a scenario; all without")
    parser.add_argument("--seconds", type=float, default=30.0, help="how long each is measured")
    parser.add_argument("--repeat", type=int, default=1, help="how often each is run, from the start")
    parser.add_argument("--json", action="store_true", help="one JSON object a run")
    given = parser.parse_args()
    chosen = [one for one in SCENARIOS if not given.scenario or any(w in one.name for w in given.scenario)]
    reached = True
    if not given.json:
        print(heading())
    for scenario in chosen:
        for _ in range(given.repeat):
            row = scenario.run(given.seconds)
            reached = reached and row["reached"]
            print(json.dumps(row) if given.json else line(row), flush=True)
    return 0 if reached else 1


if __name__ == "__main__":
    raise SystemExit(main())
