"""``python -m gateway.simulator SITE --dir DIR``: the lines of a site on ptys."""

from __future__ import annotations

import argparse
import asyncio
import signal
import sys
from collections.abc import Coroutine, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from gateway.mapping.load import load_site
from gateway.simulator.bank import UnsupportedError
from gateway.simulator.site import run


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code 0 after SIGTERM or SIGINT, 1 when the site cannot be simulated."""
    options = _parser().parse_args(arguments)
    site, findings = load_site(options.site)
    if site is None:
        return _complain(*(str(finding) for finding in findings))
    try:
        asyncio.run(_until_signal(run(site, options.dir, options.line, speed=options.speed, ready=_announce)))
    except (UnsupportedError, OSError) as error:
        return _complain(str(error))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gateway.simulator",
        description="Run the lines of a site as pseudo terminals with simulated drives. "
        "Prints the name and path of each line as soon as it can be opened.",
    )
    parser.add_argument("site", type=Path, metavar="SITE", help="site file")
    parser.add_argument("--dir", type=Path, required=True, help="folder for the ports, one per line")
    parser.add_argument("--line", action="append", metavar="NAME", help="only this line; may be repeated")
    parser.add_argument(
        "--speed", type=_positive, default=1.0, metavar="FACTOR", help="motors ramp so many times faster"
    )
    return parser


def _positive(text: str) -> float:
    number = float(text)
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError("must be a number above 0")
    return number


def _announce(name: str, path: Path) -> None:
    sys.stdout.write(f"{name} {path}\n")
    sys.stdout.flush()


def _complain(*lines: str) -> int:
    sys.stderr.writelines(f"{line}\n" for line in lines)
    return 1


async def _until_signal(work: Coroutine[Any, Any, None]) -> None:
    task = asyncio.ensure_future(work)
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, task.cancel)
    with suppress(asyncio.CancelledError):
        await task


if __name__ == "__main__":
    sys.exit(main())
