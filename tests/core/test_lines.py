"""The core's lines together: a tick reaches those whose time has come."""

from __future__ import annotations

from dataclasses import replace

from gateway.core.drive import Drive
from gateway.core.lines import Lines
from gateway.line.interface import Transmit, Want
from tests.core.world import make_site


def two_lines() -> Lines:
    """Two open lines, one drive each, of which a register is wanted: every second and every ten."""
    site = make_site()
    other = replace(
        site.lines[0], name="south", drives=(replace(site.drives[0], name="fan-9", line="south"),)
    )
    site = replace(site, lines=(*site.lines, other))
    lines = Lines(site, [Drive(config) for config in site.drives], lambda job: True)
    lines.start(0.0)
    for name, period in (("north", 1.0), ("south", 10.0)):
        lines.port_opened(name, 0.0)
        lines.demand(name, [Want(5, 0x20, 1, period)], 0.0)
    return lines


def sent(lines: Lines) -> list[str]:
    """The lines that sent something since the last look."""
    did = []
    while (action := lines.next_action()) is not None:
        did.append(action)
    return [name for name, action in did if isinstance(action, Transmit)]


def test_a_tick_reaches_the_lines_that_are_due() -> None:
    lines = two_lines()
    start = lines.wake()
    assert start is not None
    lines.tick(start)
    assert sent(lines) == ["north", "south"]
    silent = lines.wake()
    assert silent is not None
    lines.tick(silent - 1e-6)
    assert sent(lines) == [] and lines.wake() == silent


def test_what_a_line_did_changes_when_it_is_due() -> None:
    lines = two_lines()
    before = lines.wake()
    lines.port_lost("north", "pulled out", 0.001)
    lines.port_lost("south", "pulled out", 0.001)
    after = lines.wake()
    assert before is not None and after is not None and after > before
