"""The command lines of the programs that the supervisor runs. Pure."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol


class Programs(Protocol):
    """What is run for each part; tests put their own in."""

    def core(self, control: int, ports: Mapping[str, str]) -> Sequence[str]:
        """The core, with the number of its control socket and the ports that differ from the site file."""
        ...

    def adapter(self, kind: str, bridge: int) -> Sequence[str]:
        """The adapter ``opcua`` or ``mqtt``, with the number of its bridge socket."""
        ...

    def simulator(self, line: str, folder: Path) -> Sequence[str]:
        """Virtual drives for a line; the pty is linked as ``folder/line``."""
        ...


class GatewayPrograms:
    """The real ones: modules of this package, run by this interpreter."""

    def __init__(self, site: Path) -> None:
        self._site = str(site)

    def core(self, control: int, ports: Mapping[str, str]) -> Sequence[str]:
        lines = [word for name, port in ports.items() for word in ("--line", f"{name}={port}")]
        return _module("gateway.core", "--site", self._site, "--control-fd", str(control), *lines)

    def adapter(self, kind: str, bridge: int) -> Sequence[str]:
        return _module(f"gateway.northbound.{kind}", "--fd", str(bridge))

    def simulator(self, line: str, folder: Path) -> Sequence[str]:
        return _module("gateway.simulator", self._site, "--dir", str(folder), "--line", line)


def _module(name: str, *words: str) -> Sequence[str]:
    return (sys.executable, "-m", name, *words)
