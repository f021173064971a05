"""Runs a gateway: the core, a process per adapter, and what a demo needs beside them.

Whatever ends is started again. When the supervisor ends, by a signal or by force, everything ends.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import structlog

from gateway.bridge.place import running
from gateway.mapping.site import Site
from gateway.supervise.adapter import Adapter
from gateway.supervise.broker import Broker
from gateway.supervise.core import Core
from gateway.supervise.keeper import Helper, Keeper, StartRefusedError
from gateway.supervise.notify import notify
from gateway.supervise.programs import GatewayPrograms, Programs

ADAPTER_GRACE, CORE_GRACE, HELPER_GRACE = 0.7, 0.8, 0.3
"""Seconds from SIGTERM to SIGKILL for each kind, one kind after the other: together under 2 s."""

LINK_SECONDS = 5.0
"""How long the core's start waits for the simulated lines to be there."""

SIMULATED = "simulated:"

_log = structlog.get_logger(__name__)


class Supervisor:
    """One gateway as a family of processes. Use each supervisor once, from the main thread."""

    def __init__(
        self,
        site: Site,
        ports: Mapping[str, str] | None = None,
        *,
        programs: Programs | None = None,
        log: int | None = None,
    ) -> None:
        """``ports`` replaces the ports of lines by name; ``log`` is a file descriptor for what the
        children log (None: our standard error)."""
        self._site = site
        self._programs = programs or GatewayPrograms(site.path)
        self._log = log
        self._stop = asyncio.Event()
        self._links = site.data / "simulated"
        self._simulated = [name for name, port in _ports(site, ports or {}) if port == SIMULATED]
        self._given = dict(ports or {})
        self.broker = Broker.for_site(site, log)
        """The embedded broker; None when no section of the site asks for it."""
        self.core = Core(self._core_argv, log)
        self.adapters = list(self._make_adapters())
        self.core.dependants.extend(self.adapters)
        self.helpers = list(self._make_helpers())
        self.ready = asyncio.Event()
        """Set when the core is ready and every adapter was started."""

    def stop(self) -> None:
        """Ask for the end; `run` returns within 2 s."""
        self._stop.set()

    async def run(self) -> None:
        """Run everything until `stop`.

        Raises:
            StartRefusedError: if another gateway runs on the same data folder.
        """
        if running(self._site.data):
            raise StartRefusedError(f"another gateway is already running on {self._site.data}")
        self._forget_old_links()
        tasks = [_task(keeper.keep()) for keeper in (*self.helpers, *self.adapters)]
        tasks += [_task(self._keep_core()), _task(self._tell_ready()), _task(self._stop.wait())]
        try:
            await self._until_the_end(tasks)
        finally:
            await self._end(tasks)

    def _forget_old_links(self) -> None:
        self._links.mkdir(parents=True, exist_ok=True)
        for name in self._simulated:
            self._link(name).unlink(missing_ok=True)

    async def _keep_core(self) -> None:
        """Keep the core running from the moment that the simulated lines are there."""
        with contextlib.suppress(TimeoutError):  # a core goes on trying to open its ports
            async with asyncio.timeout(LINK_SECONDS):
                while not self._linked():  # noqa: ASYNC110 - nothing tells that a file appeared
                    await asyncio.sleep(0.02)
        await self.core.keep()

    async def _until_the_end(self, tasks: Sequence[asyncio.Task[None]]) -> None:
        """Return when the stop was asked for; raise what ended a keeper."""
        pending = set(tasks)
        while not self._stop.is_set():
            done, pending = await asyncio.wait(pending, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()

    async def _tell_ready(self) -> None:
        await self.core.up.wait()
        for adapter in self.adapters:
            await adapter.alive.wait()
        self.ready.set()
        _log.info("ready", site=self._site.site)
        notify("READY=1")

    async def _end(self, tasks: Sequence[asyncio.Task[None]]) -> None:
        """Adapters first, so that nobody asks for anything more; then the core; then what it leans on."""
        notify("STOPPING=1")
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await _stop_all(self.adapters, ADAPTER_GRACE)
        await _stop_all([self.core], CORE_GRACE)
        await _stop_all(self.helpers, HELPER_GRACE)
        _log.info("stopped")

    def _core_argv(self, control: int) -> Sequence[str]:
        simulated = {name: str(self._link(name)) for name in self._simulated}
        return self._programs.core(control, self._given | simulated)

    def _linked(self) -> bool:
        return all(self._link(name).exists() for name in self._simulated)

    def _link(self, line: str) -> Path:
        return self._links / line

    def _make_helpers(self) -> Iterator[Keeper]:
        for name in self._simulated:
            argv = self._programs.simulator(name, self._links)
            yield Helper(f"simulator {name}", argv, self._log)
        if self.broker is not None:
            yield self.broker

    def _make_adapters(self) -> Iterator[Adapter]:
        if self._site.opcua is not None:
            yield self._adapter("opcua", "opcua", {"adapter": "opcua", "ceiling": "admin"})
        for index, section in enumerate(self._site.mqtt):
            header = {"adapter": "mqtt", "index": index, "ceiling": mqtt_ceiling(section)}
            if self.broker is not None and self.broker.serves(section):
                header["broker"] = self.broker.address
            yield self._adapter(f"mqtt {index}", "mqtt", header)

    def _adapter(self, name: str, kind: str, header: Mapping[str, Any]) -> Adapter:
        return Adapter(name, lambda fd: self._programs.adapter(kind, fd), header, self.core, self._log)


def mqtt_ceiling(section: Mapping[str, Any]) -> str:
    """The highest role that commands through a broker can have: what the site grants, else none."""
    commands = section.get("commands") or {}
    return str(commands.get("role", "viewer"))


async def run_until_signal(supervisor: Supervisor) -> None:
    """Run a supervisor until SIGTERM or SIGINT. Raises as `Supervisor.run`."""
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, supervisor.stop)
    await supervisor.run()


def _ports(site: Site, given: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    return ((line.name, given.get(line.name, line.port)) for line in site.lines)


def _task(coroutine: Any) -> asyncio.Task[None]:
    return asyncio.get_running_loop().create_task(coroutine)


async def _stop_all(keepers: Iterable[Keeper], grace: float) -> None:
    await asyncio.gather(*(keeper.stop(grace) for keeper in keepers))
