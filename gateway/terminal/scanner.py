"""A scan in the terminal: from the words of the command line to the progress bar and the end."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from gateway.line.port import PortError, is_pseudo_terminal
from gateway.mapping.profile import SerialFormat
from gateway.modbus.framing import FramingName
from gateway.scan.asker import Asker
from gateway.scan.order import Narrowed, Plan, PortKind, make_plan
from gateway.scan.search import Found, Report, search
from gateway.terminal.errors import CommandError, UsageError
from gateway.terminal.models import builtin_profiles, profile_named
from gateway.terminal.output import say, say_json
from gateway.terminal.scanning import end_lines, end_object, found_lines, found_object, plan_line, site_lines

SERIAL_PATIENCE, NETWORK_PATIENCE = 0.2, 0.5
INTERRUPTED = 130
BY_ID = Path("/dev/serial/by-id")


class Choices(NamedTuple):
    """Words of the command line that narrow a scan; empty: no choice."""

    bauds: Sequence[int]
    formats: Sequence[str]
    framings: Sequence[str]
    units: Sequence[str]
    profiles: Sequence[str]


def plan_of(port: str, choices: Choices, timeout: float | None, all_settings: bool) -> Plan:
    """What is to be done.

    Raises:
        UsageError: if a word cannot be understood, or nothing is left to do.
    """
    kind = _kind(port, choices)
    narrowed = Narrowed(
        tuple(_framing(word) for word in choices.framings),
        tuple(choices.bauds),
        tuple(_format(word) for word in choices.formats),
        tuple(dict.fromkeys(unit for word in choices.units for unit in _units(word))),
    )
    profiles = [profile_named(name) for name in choices.profiles] or builtin_profiles()
    patience = timeout or (NETWORK_PATIENCE if kind in ("network", "modbus") else SERIAL_PATIENCE)
    plan = make_plan(profiles, narrowed, patience, kind, all_settings)
    if not plan.rounds:
        raise UsageError("no profile knows such a setting (see: gateway profiles NAME)")
    return plan


def run_scan(port: str, plan: Plan, as_json: bool) -> int:
    """Scan, tell what is found as it is found, and the rest at the end; the exit code.

    Raises:
        CommandError: if the port cannot be used.
    """
    report, asker, began, name = Report(), Asker(port), time.monotonic(), _lasting_name(port)
    sys.stderr.write(plan_line(port, plan) + "\n")
    code, trouble = 0, None
    with _progress(plan, report) as moved:
        try:
            asyncio.run(asker.run(search(plan, report), _teller(as_json), moved))
        except KeyboardInterrupt:
            code = INTERRUPTED
        except PortError as error:
            trouble = CommandError(_explained(port, error))
    if as_json:
        say_json(end_object(name, plan, report, asker.strangers, time.monotonic() - began))
    elif trouble is None or report.asked:
        _tell_end(name, plan, report, asker.strangers)
    if trouble is not None:
        raise trouble
    return code or (0 if report.found else 1)


def _teller(as_json: bool) -> Callable[[Found], None]:
    if as_json:
        return lambda found: say_json(found_object(found))
    return lambda found: say("\n".join(found_lines(found)))


def _tell_end(port: str, plan: Plan, report: Report, strangers: int) -> None:
    for line in end_lines(plan, report, strangers):
        say(line)
    if report.found:
        say("\n# a beginning for the site file; suggestions are no proof: compare the nameplates,")
        say("# then: gateway check SITE --live")
        say("\n".join(site_lines(port, report.found)))


@contextmanager
def _progress(plan: Plan, report: Report) -> Iterator[Callable[[], None]]:
    """A bar on standard error, if that is a terminal; what it yields is called after each request."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda: None
        return
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f}%")
    # what is found goes to standard output even where the bar is on a terminal and that is not
    both = sys.stdout.isatty()
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, redirect_stdout=both
    ) as bar:
        task = bar.add_task("", total=plan.asks)

        def moved() -> None:
            at = min(len(report.tried), len(plan.rounds) - 1)
            bar.update(task, completed=report.asked, description=str(plan.rounds[at].setting))

        yield moved


def _kind(port: str, choices: Choices) -> PortKind:
    scheme = urlsplit(port).scheme
    if scheme == "simulated":
        raise UsageError("a simulated line has no port of its own (start it: gateway simulate SITE)")
    if scheme not in ("tcp", "modbus"):
        return "pseudo" if is_pseudo_terminal(port) else "serial"
    if choices.bauds or choices.formats:
        raise UsageError("speed and format of a network port are set at its far end")
    if scheme == "modbus" and choices.framings:
        raise UsageError("modbus:// has a framing of its own")
    return "modbus" if scheme == "modbus" else "network"


def _lasting_name(port: str) -> str:
    """What the site file should call a port: a name that stays when adapters are plugged in anew."""
    if "://" in port:
        return port
    device = Path(port).resolve()
    names = (name for name in BY_ID.glob("*") if name.resolve() == device)
    return str(next(names, Path(port).absolute()))


def _framing(word: str) -> FramingName:
    if word == "rtu":
        return "rtu"
    if word == "ascii":
        return "ascii"
    raise UsageError(f"{word!r} is neither rtu nor ascii")


def _format(word: str) -> SerialFormat:
    bits, parity, stops = (*word.upper(), "", "", "")[:3]
    if len(word) != 3 or bits not in "78" or parity not in "NEO" or stops not in "12":
        raise UsageError(f"{word!r} is no format like 8N2")
    return SerialFormat(int(bits), "N" if parity == "N" else "E" if parity == "E" else "O", int(stops))


def _units(word: str) -> range:
    low, dots, high = word.partition("..")
    numbers = [low, high] if dots else [low, low]
    if not all(number.isascii() and number.isdecimal() for number in numbers):
        raise UsageError(f"{word!r} is no unit address, nor a range like 1..31")
    first, last = map(int, numbers)
    if not 1 <= first <= last <= 247:
        raise UsageError(f"{word!r}: units are 1..247")
    return range(first, last + 1)


def _explained(port: str, error: PortError) -> str:
    if "lock" in str(error) or "busy" in str(error):
        return f"{port} is in use (by a running gateway? it must be stopped first)"
    return str(error)
