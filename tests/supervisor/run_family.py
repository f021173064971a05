"""Runs a supervisor over stand-ins and prints the children's process ids, until it is killed.

Usage: run_family.py FOLDER
"""

import asyncio
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from gateway.log import configure
from tests.supervisor.family import Stage, performing, small_site


async def main() -> None:
    folder = Path(sys.argv[1])
    async with performing(Stage(folder / "stage"), small_site(folder)) as supervisor:
        await supervisor.ready.wait()
        print(supervisor.core.pid, *(adapter.pid for adapter in supervisor.adapters), flush=True)
        await asyncio.Event().wait()


configure("supervisor")
asyncio.run(main())
