"""The shell on real ports: what virtual time cannot show."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from gateway.core import shell as shell_module
from gateway.core.core import Core
from gateway.core.direct import DirectBridge, open_core
from gateway.core.events import Action, Event, Ticked, Transmit
from gateway.core.shell import Shell
from gateway.line.port import Port, PortError, open_port
from gateway.mapping.site import LineConfig, Site
from gateway.tag import Cause, Instant, Origin, Outcome, Quality, Role, Sample, Verdict
from tests.core.fieldbus import Framing, PtyDrive, TcpDrive, ascii_, modbus_tcp, rtu, write_site
from tests.core.plant import load

PATIENCE = 20.0
ENGINEER = Origin(through="cli", who="erika", role=Role.ENGINEER)
FREQUENCY = "fan-1.output_frequency"


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.005)


async def sample(bridge: DirectBridge) -> Sample:
    [found] = await bridge.read([FREQUENCY])
    return found


async def until_quality(bridge: DirectBridge, good: bool) -> Sample:
    async with asyncio.timeout(PATIENCE):
        while ((found := await sample(bridge)).quality is Quality.GOOD) is not good:
            await asyncio.sleep(0.01)
    return found


async def write(bridge: DirectBridge, hertz: float, ttl: float = 5.0) -> Outcome:
    return await bridge.write("fan-1.frequency_command", hertz, ENGINEER, ttl)


async def line_up(bridge: DirectBridge) -> bool:
    return (await bridge.health()).lines[0].up


@contextlib.asynccontextmanager
async def plugged(
    folder: Path, framing: Framing = rtu, echo: bool = False, there: bool = True
) -> AsyncIterator[PtyDrive]:
    drive = PtyDrive(folder / "tty", framing, echo)
    if there:
        drive.plug()
    try:
        yield drive
    finally:
        drive.unplug()


async def test_reads_and_writes_on_a_tty(tmp_path: Path) -> None:
    site = load(write_site(tmp_path, "tty"))
    async with plugged(tmp_path) as drive, open_core(site) as bridge:
        assert (await sample(bridge)).value == 60.0
        assert (await write(bridge, 12.5)).verdict is Verdict.CONFIRMED
        assert drive.unit.writes == [(2, (1250,))]


async def test_unplugged_and_plugged_again(tmp_path: Path) -> None:
    site = load(write_site(tmp_path, "tty"))
    async with plugged(tmp_path) as drive, open_core(site) as bridge:
        await bridge.watch({FREQUENCY: 0.05})
        await until_quality(bridge, good=True)
        drive.unplug()
        lost = await until_quality(bridge, good=False)
        assert lost.quality is Quality.LINE_DOWN
        assert lost.value is None
        outcome = await write(bridge, 30.0, ttl=0.5)
        assert (outcome.verdict, outcome.cause, outcome.sent) == (Verdict.FAILED, Cause.LINE_DOWN, 0)
        drive.plug()
        assert (await until_quality(bridge, good=True)).value == 60.0
        assert await line_up(bridge)
        assert drive.unit.writes == [], "nothing is written afterwards"


async def test_a_port_that_is_not_there_is_tried_again(tmp_path: Path) -> None:
    site = load(write_site(tmp_path, "tty"))
    async with plugged(tmp_path, there=False) as drive, open_core(site) as bridge:
        assert "tty" in (await bridge.health()).lines[0].reason
        drive.plug()
        await until_quality(bridge, good=True)


async def test_the_port_is_given_back(tmp_path: Path) -> None:
    site = load(write_site(tmp_path, "tty"))
    async with plugged(tmp_path) as drive:
        async with open_core(site) as bridge:
            await bridge.watch({FREQUENCY: 0.05})
            await until_quality(bridge, good=True)
            with pytest.raises(PortError, match="busy"):
                await open_port(site.lines[0])
        heard = len(drive.heard)
        (await open_port(site.lines[0])).close()
        await asyncio.sleep(0.15)
        assert len(drive.heard) == heard, "nothing is asked any more"


async def test_stopping_tells_everyone(tmp_path: Path) -> None:
    site = load(write_site(tmp_path, "tty"))
    async with plugged(tmp_path) as drive:
        async with open_core(site) as bridge:
            await sample(bridge)
            drive.unit.on = False
            outcomes = [asyncio.ensure_future(write(bridge, hertz)) for hertz in (10.0, 20.0)]
            await until(lambda: b"\x05\x06" in drive.heard)
            shell = bridge._shell
            await shell.stop()
            first, second = await asyncio.wait_for(asyncio.gather(*outcomes), 5)
        assert first.verdict in (Verdict.UNKNOWN, Verdict.SUPERSEDED), first
        assert second.verdict is not Verdict.CONFIRMED
        assert drive.unit.writes == []


async def test_an_open_that_hangs_stalls_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    site = load(write_site(tmp_path, "tty"))
    never: asyncio.Future[Port] = asyncio.get_running_loop().create_future()

    async def hang(config: LineConfig) -> Port:
        return await never

    monkeypatch.setattr(shell_module, "open_port", hang)
    monkeypatch.setattr("gateway.core.direct.OPEN_SECONDS", 0.05)
    async with open_core(site) as bridge:
        outcome = await asyncio.wait_for(write(bridge, 10.0, ttl=0.3), 5)
        assert (outcome.verdict, outcome.cause, outcome.sent) == (Verdict.FAILED, Cause.LINE_DOWN, 0)
    await asyncio.sleep(0)
    assert never.cancelled()


async def test_timers_never_fire_early(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last microseconds are waited out by looking at the clock: a frame that is sent early breaks the
    silence that drives need."""
    site = load(write_site(tmp_path, "tty"))
    early: list[float] = []
    ticks = 0

    async with plugged(tmp_path):
        shell = Shell(site, {})
        step, wake = shell.core.step, shell.core.wake

        def watched(event: Event, now: Instant) -> list[Action]:
            nonlocal ticks
            due = wake()
            if isinstance(event, Ticked):
                ticks += 1
                if due is not None and time.monotonic() < due:
                    early.append(due - time.monotonic())
            return step(event, now)

        monkeypatch.setattr(shell.core, "step", watched)
        bridge = DirectBridge(shell, "test", Role.ADMIN)
        shell.start()
        await bridge.watch({FREQUENCY: 0.02})
        await until(lambda: ticks > 50)
        await bridge.close()
        await shell.stop()
    assert early == []


@pytest.mark.parametrize("form", ["7E1", "7N2", "7O1"])
async def test_ascii(tmp_path: Path, form: str) -> None:
    site = load(write_site(tmp_path, "tty", f"framing: ascii, serial: 9600 {form}"))
    async with plugged(tmp_path, ascii_) as drive, open_core(site) as bridge:
        assert (await sample(bridge)).value == 60.0
        assert (await write(bridge, 12.5)).verdict is Verdict.CONFIRMED
        assert drive.unit.writes == [(2, (1250,))]
        assert b":0506000204E20D\r\n" in drive.heard


@pytest.mark.parametrize("framing", ["rtu", "ascii"])
async def test_a_transceiver_that_echoes(tmp_path: Path, framing: str) -> None:
    serial = "8N2" if framing == "rtu" else "7E1"
    more = f"framing: {framing}, serial: 9600 {serial}, rs485: {{echo: true}}"
    site = load(write_site(tmp_path, "tty", more))
    async with (
        plugged(tmp_path, rtu if framing == "rtu" else ascii_, echo=True) as drive,
        open_core(site) as bridge,
    ):
        assert (await sample(bridge)).value == 60.0
        assert (await write(bridge, 12.5)).verdict is Verdict.CONFIRMED
        assert drive.unit.writes == [(2, (1250,))]
        assert (await bridge.health()).lines[0].timeouts == 0


def network_site(folder: Path, scheme: str, port: int) -> Site:
    serial = {"tcp": "framing: rtu, serial: 9600 8N2", "modbus": "rs485: {}"}[scheme]
    return load(write_site(folder, f"{scheme}://127.0.0.1:{port}", serial))


@pytest.mark.parametrize(("scheme", "framing"), [("tcp", rtu), ("modbus", modbus_tcp)])
async def test_over_a_network(tmp_path: Path, scheme: str, framing: Framing) -> None:
    async with TcpDrive(framing) as drive, open_core(network_site(tmp_path, scheme, drive.port)) as bridge:
        assert (await sample(bridge)).value == 60.0
        assert (await write(bridge, 12.5)).verdict is Verdict.CONFIRMED
        assert drive.unit.writes == [(2, (1250,))]


@pytest.mark.parametrize(("scheme", "framing"), [("tcp", rtu), ("modbus", modbus_tcp)])
async def test_a_server_that_goes_away(tmp_path: Path, scheme: str, framing: Framing) -> None:
    async with TcpDrive(framing) as drive, open_core(network_site(tmp_path, scheme, drive.port)) as bridge:
        await bridge.watch({FREQUENCY: 0.05})
        await until_quality(bridge, good=True)
        before = (await bridge.health()).lines[0].answered
        await drive.drop()
        await until_quality(bridge, good=False)
        await until_quality(bridge, good=True)
        assert (await bridge.health()).lines[0].answered > before


async def test_rts_on_a_port_that_cannot_says_so(tmp_path: Path) -> None:
    site = load(write_site(tmp_path, "tty", "framing: rtu, serial: 9600 8N2, rs485: {rts: send_high}"))
    async with plugged(tmp_path), open_core(site) as bridge:
        reason = (await bridge.health()).lines[0].reason
        assert reason.startswith(f"{tmp_path / 'tty'}: this port cannot switch the direction by RTS"), reason


async def test_a_read_that_goes_out_before_it_is_decided_goes_out_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    foretold: list[bytes] = []
    look_ahead = Core.look_ahead

    def spied(core: Core, at: float) -> list[Transmit]:
        found = look_ahead(core, at)
        foretold.extend(action.data for action in found)
        return found

    monkeypatch.setattr(Core, "look_ahead", spied)
    site = load(write_site(tmp_path, "tty"))
    async with plugged(tmp_path) as drive, open_core(site) as bridge:
        await bridge.watch({FREQUENCY: 0.05})
        await until(lambda: len(drive.heard) > 8 * 20)
        await write(bridge, 12.5)
        await bridge.watch({FREQUENCY: None})
        page = await bridge.trace("north")
        heard = drive.heard
    sent = b"".join(frame.data for frame in page.frames if frame.sent)
    assert len(foretold) > 10
    assert heard.startswith(sent) and len(heard) - len(sent) <= 16, "the last ones are not in the trace yet"
