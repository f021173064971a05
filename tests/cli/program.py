"""The command line as a program: started, fed, read."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

GATEWAY = (sys.executable, "-m", "gateway")


class Ran(NamedTuple):
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def objects(self) -> list[dict[str, Any]]:
        """Standard output as one JSON object a line."""
        return [json.loads(line) for line in self.out.splitlines()]


def gateway(*words: str | Path, stdin: str = "") -> Ran:
    """Run ``gateway`` with these words."""
    done = subprocess.run(
        [*GATEWAY, *map(str, words)], input=stdin, capture_output=True, text=True, timeout=60, check=False
    )
    return Ran(done.returncode, done.stdout, done.stderr)


def small_site(folder: Path, writes: bool = True) -> Path:
    """A site file with one simulated 7200GS and no northbound."""
    path = folder / "site.yaml"
    path.write_text(
        f"""
site: plant7
gateway: gw1
lines:
  north:
    port: "simulated:"
    serial: 9600 8N2
    drives:
      fan-1: {{profile: teco-7200gs, unit: 5, control: {{lease: off}}}}
writes: {{enabled: {str(writes).lower()}}}
""",
        encoding="utf-8",
    )
    return path
