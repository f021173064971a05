"""The port of a scan: sends one request after the other, keeps the silences, recognises replies. Shell."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from time import monotonic

from gateway.line.port import Port, PortError, open_port
from gateway.mapping.site import LineConfig, Rs485
from gateway.modbus.framing import Framing, framing_of
from gateway.scan.ask import Answer
from gateway.scan.order import Round
from gateway.scan.search import Found, Query, Scan, SetTo

WAIT_FOR_SILENCE = 0.5
"""Seconds that a request waits for somebody else on the line to come to an end, at most."""
EXCEPTION_BYTES = 2


class Asker:
    """One port, in one setting after the other. ``strangers`` counts bytes that nobody asked for."""

    def __init__(self, port: str) -> None:
        self.strangers = 0
        self._url = port
        self._port: Port | None = None
        self._round: Round | None = None
        self._framing: Framing = framing_of("rtu")
        self._echo = False
        self._inbox: asyncio.Queue[bytes | PortError] = asyncio.Queue()
        self._busy_until = 0.0

    async def run(self, scan: Scan, tell: Callable[[Found], None], asked: Callable[[], None]) -> None:
        """Carry a scan out. ``tell`` hears of each unit that is found, ``asked`` of each request.

        Raises:
            PortError: if the port cannot be opened, or vanishes.
        """
        answer: Answer | None = None
        try:
            while True:
                step = scan.send(answer)
                answer = None
                if isinstance(step, Query):
                    answer = await self._ask(step)
                    asked()
                elif isinstance(step, SetTo):
                    await self._open(step.round)
                else:
                    tell(step)
        except StopIteration:
            pass
        finally:
            self._close()

    async def _open(self, round: Round) -> None:
        """Open the port anew; a network connection stays if its framing does."""
        setting = round.setting
        self._close()
        config = LineConfig(
            name="scan",
            port=self._url,
            framing=setting.framing,
            baud=setting.baud,
            format=setting.format,
            rs485=Rs485(),
            drives=(),
        )
        self._port = await open_port(config)
        self._round, self._framing = round, framing_of(setting.framing)
        inbox: asyncio.Queue[bytes | PortError] = asyncio.Queue()
        self._inbox = inbox
        self._port.attach(
            lambda data, _: inbox.put_nowait(data), lambda reason: inbox.put_nowait(self._vanished(reason))
        )
        self._busy_until = monotonic()

    def _close(self) -> None:
        if self._port is not None:
            self._port.close()
            self._port = None

    async def _ask(self, query: Query) -> Answer:
        assert self._port is not None and self._round is not None
        await self._silence()
        request = query.ask.request
        data = self._framing.encode(query.unit, request.pdu)
        seeker = self._framing.seeker(data, request, self._echo)
        asked_at = monotonic()
        ends = self._write(data)
        longest = self._duration(self._framing.size(request.reply_length))
        reply, heard, deadline = None, 0, ends + query.patience + longest
        while reply is None and (piece := await self._piece(deadline)):
            heard += len(piece)
            reply = seeker.feed(piece)
        self._busy_until = max(ends, self._busy_until)
        self._echo = self._echo or seeker.echoed
        if reply is None:
            own = len(data) if self._echo else 0
            await asyncio.sleep(query.patience if query.settle else 0)
            return Answer(None, noise=heard > own)
        length = request.reply_length if reply.exception is None else EXCEPTION_BYTES
        both = self._duration(len(data) + self._framing.size(length))
        return Answer(reply, max(0.0, monotonic() - asked_at - both))

    def _write(self, data: bytes) -> float:
        """Send; when the last bit of it has left, at the latest."""
        assert self._port is not None
        try:
            self._port.write(data)
        except OSError as error:
            raise self._vanished(error.strerror or str(error)) from error
        return monotonic() + self._duration(len(data))

    def _vanished(self, reason: str) -> PortError:
        return PortError(f"{self._url} is gone: {reason}")

    def _duration(self, characters: int) -> float:
        assert self._round is not None
        return self._round.timing.duration(characters) if self._round.setting.serial else 0.0

    async def _silence(self) -> None:
        """Wait until the line has been silent as long as it must be; what comes meanwhile is a stranger's."""
        assert self._round is not None
        limit = monotonic() + WAIT_FOR_SILENCE
        while (free_at := self._busy_until + self._round.timing.gap) > monotonic() and monotonic() < limit:
            self.strangers += len(await self._piece(free_at))
        while not self._inbox.empty():
            self.strangers += len(await self._piece(limit))

    async def _piece(self, deadline: float) -> bytes:
        """What came in; nothing once the deadline has passed."""
        try:
            async with asyncio.timeout(max(0.0, deadline - monotonic())):
                piece = await self._inbox.get()
        except TimeoutError:
            return b""
        if isinstance(piece, PortError):
            raise piece
        self._busy_until = monotonic()
        return piece
