"""Fuzz one framing, or all of them, for longer."""

from __future__ import annotations

import argparse
import time
from typing import get_args

from gateway.modbus.framing import FramingName
from tests.modbus.fuzz.target import fuzz


def main() -> None:
    """Run, and print what was seen."""
    parser = argparse.ArgumentParser(prog="python -m tests.modbus.fuzz", description=__doc__)
    parser.add_argument("--framing", choices=get_args(FramingName), help="only this one")
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    for name in [given.framing] if given.framing else get_args(FramingName):
        began = time.monotonic()
        seen = fuzz(name, given.inputs, given.seed)
        took = time.monotonic() - began
        print(f"{name}: {given.inputs} inputs, seed {given.seed}, {len(seen)} kinds of outcome, {took:.0f} s")


if __name__ == "__main__":
    main()
