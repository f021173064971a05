"""A simulated line in real time: a thread between a pty and the model of the wire."""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Collection, Mapping
from pathlib import Path
from queue import SimpleQueue
from time import monotonic
from types import MappingProxyType

from gateway.mapping.site import LineConfig
from gateway.simulator.adapter import LatencyTimer
from gateway.simulator.build import build_drives, wire_timing
from gateway.simulator.drive import Drive
from gateway.simulator.happening import Options
from gateway.simulator.line import Line, garbled
from gateway.simulator.pty import Pty
from gateway.simulator.wire import WireFrame

SPIN = 0.0002
"""Seconds before the end of a reply in which the thread asks again and again instead of sleeping: the
kernel wakes a sleeper 50 to 150 microseconds late."""


class SimulatedLine:
    """The drives of one line behind a pty, from `start` (or ``with``) to `close`.

    ``path`` is what the master opens; at another speed than the line's no drive understands it. ``drives``
    may be looked at and tampered with while the line runs. Times in ``log`` are of `time.monotonic`.
    ``latency`` is the period in seconds of the adapter's latency timer. Each drive in ``doubled`` has a
    second one at its address, which answers too.
    """

    def __init__(
        self,
        config: LineConfig,
        folder: Path,
        *,
        options: Mapping[str, Options] = MappingProxyType({}),
        strict: bool = True,
        speed: float = 1.0,
        latency: float = 0.0,
        doubled: Collection[str] = (),
    ) -> None:
        self.name = config.name
        self.path = folder / config.name
        self.drives: Mapping[str, Drive] = build_drives(config, options, speed)
        twins = build_drives(config, options, speed)
        everybody = [*self.drives.values(), *(twins[name] for name in doubled)]
        self._line = Line(wire_timing(config), everybody, strict=strict, echo=config.rs485.echo)
        self.adapter = LatencyTimer(latency)
        self._strangers: SimpleQueue[bytes] = SimpleQueue()
        self._thread: threading.Thread | None = None
        self._stop_reader = self._stop_writer = -1

    @property
    def silence(self) -> float:
        """Seconds of silence that the drives want before each request."""
        return self._line.timing.silence

    @property
    def log(self) -> list[WireFrame]:
        """The frames that were on the wire, oldest first."""
        return list(self._line.log)

    def intrude(self, data: bytes) -> None:
        """Let another master send a request as soon as the line is free."""
        self._strangers.put(data)

    def start(self) -> None:
        """Plug the line in: ``path`` exists and the drives answer. Nothing happens if it is plugged in."""
        if self._thread is not None:
            return
        pty = Pty(self.path, self._line.timing.baud)
        self._stop_reader, self._stop_writer = os.pipe()
        self._thread = threading.Thread(
            target=self._serve, args=(pty,), name=f"line {self.name}", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Pull the line out: ``path`` goes away, the drives keep their state. `start` plugs it in again."""
        if self._thread is None:
            return
        os.close(self._stop_writer)
        self._thread.join()
        os.close(self._stop_reader)
        self._thread = None

    def __enter__(self) -> SimulatedLine:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _serve(self, pty: Pty) -> None:
        try:
            while not self._asked_to_stop(pty):
                if data := pty.read():
                    heard = data if pty.at_speed or not self._line.strict else garbled(data)
                    self._line.receive(heard, monotonic())
                while not self._strangers.empty():
                    self._line.intrude(self._strangers.get(), monotonic())
                if handed := self.adapter.take(self._line.advance(monotonic()), monotonic()):
                    pty.write(handed)
        finally:
            pty.close()

    def _asked_to_stop(self, pty: Pty) -> bool:
        """Wait until the master writes or something is due; True when the line is to be closed."""
        rest = min(self._line.due(), self.adapter.due()) - monotonic()
        pause = rest - SPIN if self._line.ends_reply else rest
        readable, _, _ = select.select([pty.fd, self._stop_reader], [], [], max(0.0, pause))
        return self._stop_reader in readable
