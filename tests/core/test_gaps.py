"""Blocks that pass over what the profile does not name, and drives that will not have it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from gateway.bridge.api import RefusedGap
from gateway.bridge.messages import AskDemand, AskHealth, DemandIs, HealthIs
from gateway.core.drive import Drive
from gateway.core.events import Asked
from gateway.core.gaps import address_codes, gaps_in
from gateway.core.memory import Memory
from gateway.core.planning import line_plans
from gateway.mapping.profile import ErrorMeaning
from gateway.mapping.site import Site
from gateway.tag import Quality
from tests.core.world import World, make_site, teco

LEFT, RIGHT = "fan-1.output_frequency", "fan-1.output_current"
"""In 0024H and 0027H: on both sides of a gap."""
BEFORE, BEHIND = "fan-1.output_monitor", "fan-1.dc_bus_voltage"
"""In 002DH and 0031H: on both sides of the next one."""


def bridging(**changes: object) -> Site:
    """A site whose profile lets reads pass over what it does not name."""
    site = make_site()
    [drive] = site.drives
    modbus = replace(drive.profile.modbus, bridge=True, holes=())
    profile = replace(drive.profile, modbus=modbus, **changes)
    line = replace(site.lines[0], drives=(replace(drive, profile=profile),))
    return replace(site, lines=(line,))


def world_of(memory: Memory | None = None, *, free: tuple[int, ...] = (), **changes: object) -> World:
    """The drive refuses reads across everything that it does not have, but for ``free`` addresses."""
    world = World(bridging(**changes), memory=memory, twins=make_site())
    world.drives["fan-1"].model.bank.words.update(dict.fromkeys(free, 0))
    return world


def asked_across(world: World, first: int, last: int, since: int = 0) -> bool:
    """Was a read across these addresses on the wire, after so many others?"""
    frames = [frame.split() for frame in world.sent("03")[since:]]
    spans = [(int(f[2] + f[3], 16), int(f[4] + f[5], 16)) for f in frames]
    return any(at < first and last < at + count - 1 for at, count in spans)


def health(world: World) -> tuple[RefusedGap, ...]:
    world.feed(Asked(world.session, AskHealth(999)))
    return next(m.health for m in world.told[world.session] if isinstance(m, HealthIs) and m.id == 999).gaps


def test_a_block_that_is_refused_is_cut_at_its_gap_and_both_parts_are_read() -> None:
    world = world_of()
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.run(3)
    assert asked_across(world, 0x25, 0x26)
    for tag in (LEFT, RIGHT):
        assert {s.quality for s in world.samples(tag)} <= {Quality.WAITING, Quality.GOOD}
        assert world.samples(tag)[-1].quality is Quality.GOOD
    before = len(world.sent("03"))
    world.run(10)
    assert not asked_across(world, 0x25, 0x26, since=before)


def test_the_finding_is_told_once_with_its_remedy_and_kept() -> None:
    world = world_of()
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.run(10)
    assert world.events().count("gap_refused") == 1
    [gap] = health(world)
    assert (gap.first, gap.last, gap.code) == (0x25, 0x26, 0x02)
    assert gap.text == (
        "fan-1 refuses reads across 0025H..0026H with 02H; what stands on both sides is read apart "
        "(add `0025H..0026H` to `holes` in the profile teco-7200gs)"
    )
    assert [entry["gap"]["first"] for entry in world.journal if entry["kind"] == "gap"] == [0x25]


def test_explain_says_why_the_read_ends_where_it_does() -> None:
    world = world_of()
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.run(10)
    world.feed(Asked(world.session, AskDemand(998, RIGHT)))
    demand = next(m.demand for m in world.told[world.session] if isinstance(m, DemandIs))
    assert [(gap.first, gap.last) for gap in demand.gaps] == [(0x25, 0x26)]


def test_after_a_restart_nothing_is_tried_again() -> None:
    before = world_of()
    before.watch({LEFT: 0.5, RIGHT: 0.5})
    before.run(10)
    world = world_of(before.memory())
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.run(5)
    assert not asked_across(world, 0x25, 0x26)
    assert world.samples(RIGHT)[-1].quality is Quality.GOOD
    assert "gap_refused" not in world.events()
    assert len(health(world)) == 1


def test_what_was_found_of_another_drive_or_is_a_hole_by_now_does_not_count() -> None:
    world = world_of()
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.run(10)
    gaps = world.memory().gaps
    [config] = bridging().drives
    assert len(gaps.of(Drive(config))) == 1
    assert gaps.of(Drive(replace(config, unit=9))) == []
    assert gaps.of(Drive(replace(config, name="fan-2"))) == []
    holes = replace(config.profile.modbus, holes=((0x25, 0x26),))
    assert gaps.of(Drive(replace(config, profile=replace(config.profile, modbus=holes)))) == []


def test_a_plan_on_paper_respects_what_was_found() -> None:
    gap = RefusedGap(drive="fan-1", profile="teco-7200gs", unit=5, first=0x2E, last=0x30, code=2, time=0)
    memory = Memory()
    memory.gaps.refused["fan-1"] = [gap]
    [plain], [knowing] = line_plans(bridging()), line_plans(bridging(), known=memory.gaps)
    ends = [[r.block.address + r.block.count for r in plan.forecast.reads] for plan in (plain, knowing)]
    assert 0x2E not in ends[0]
    assert 0x2E in ends[1]
    assert (plain.gaps, knowing.gaps) == ((), (gap,))


def test_only_the_gap_that_is_refused_is_given_up() -> None:
    """The drive has 002EH to 0030H, though no document says so."""
    world = world_of(free=(0x2E, 0x2F, 0x30))
    world.watch({LEFT: 0.5, RIGHT: 0.5, BEFORE: 0.5, BEHIND: 0.5})
    world.run(20)
    assert [(gap.first, gap.last) for gap in health(world)] == [(0x25, 0x26)]
    before = len(world.sent("03"))
    world.run(3)
    assert asked_across(world, 0x2E, 0x30, since=before)
    assert not asked_across(world, 0x25, 0x26, since=before)


def test_a_named_register_that_is_refused_accuses_no_gap() -> None:
    world = world_of(free=(0x25, 0x26))
    del world.drives["fan-1"].model.bank.words[0x27]
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.run(20)
    assert health(world) == ()
    assert "gap_refused" not in world.events()
    assert world.samples(LEFT)[-1].quality is Quality.GOOD
    assert world.samples(RIGHT)[-1].quality is Quality.REFUSED


def test_a_block_without_a_gap_is_shown_as_refused() -> None:
    world = world_of()
    del world.drives["fan-1"].model.bank.words[0x24]
    world.watch({LEFT: 0.5})
    world.run(5)
    assert world.samples(LEFT)[-1].quality is Quality.REFUSED
    assert health(world) == ()


def test_a_refusal_that_passes_leaves_no_trace() -> None:
    world = world_of()
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.until(lambda: asked_across(world, 0x25, 0x26), 5)
    refused = world.core.lines.plan("north")
    world.until(lambda: world.core.lines.plan("north") is not refused, 1)
    world.drives["fan-1"].model.bank.words.update({0x25: 0, 0x26: 0})
    world.run(20)
    assert health(world) == ()
    before = len(world.sent("03"))
    world.run(3)
    assert asked_across(world, 0x25, 0x26, since=before)


@pytest.mark.parametrize(
    ("errors", "codes"),
    [
        ({}, {2}),
        ({0x02: "illegal_address", 0x30: "illegal_address"}, {2, 0x30}),
        ({0x02: "locked", 0x30: "illegal_address"}, {0x30}),
    ],
)
def test_the_profile_tells_which_code_means_no_such_register(errors: dict[int, str], codes: set[int]) -> None:
    profile = replace(teco(), errors={code: ErrorMeaning(name) for code, name in errors.items()})
    assert set(address_codes(profile)) == codes


def test_gaps_of_a_read() -> None:
    facts = Drive(bridging().drives[0]).facts
    assert gaps_in(facts, 0x24, 4) == [(0x25, 0x26)]
    assert gaps_in(facts, 0x20, 5) == []
    assert gaps_in(facts, 0x24, 16) == [(0x25, 0x26), (0x2E, 0x30)]


def test_the_journals_own_thread_remembers_it_too(tmp_path: Path) -> None:
    from gateway.core.chain import Head, seal
    from gateway.core.disk import Folder
    from gateway.core.ledger import find

    world = world_of()
    world.watch({LEFT: 0.5, RIGHT: 0.5})
    world.run(10)
    lines, head = [], Head()
    for entry in world.journal:
        line, head = seal({key: value for key, value in entry.items() if key != "at"}, head)
        lines.append(line)
    (tmp_path / "journal-000000000001.jsonl").write_bytes(b"".join(lines))
    found = find(Folder(tmp_path)).memory.gaps.refused["fan-1"]
    assert [(gap.first, gap.last) for gap in found] == [(0x25, 0x26)]
