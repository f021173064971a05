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
from tests.simulator.master import framed

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
    assert [gap.points for gap in health(world)] == [("output_current",)]
    assert "gap_refused" not in world.events()
    assert world.samples(LEFT)[-1].quality is Quality.GOOD
    assert world.samples(RIGHT)[-1].quality is Quality.REFUSED


# -- registers that a drive has not although its profile names them


NEIGHBOURS = ("output_current", "output_voltage", "scan_count", "zero_speed", "output_monitor")
"""In 0027H to 002DH, of which 002BH is scan_count's and 002CH zero_speed's."""


def without(*addresses: int) -> World:
    """A 7200GS of another firmware, all neighbours of what it lacks watched."""
    world = World(make_site())
    lacks(world, set(addresses))
    world.watch({f"fan-1.{name}": 0.5 for name in NEIGHBOURS})
    return world


def lacks(world: World, addresses: set[int]) -> None:
    """The drive refuses what holds one of these."""
    handle = world.drives["fan-1"].handle

    def refuse(adu: bytes, now: float) -> bytes | None:
        first = int.from_bytes(adu[2:4])
        asked = range(first, first + int.from_bytes(adu[4:6]))
        refused = adu[0] == 5 and adu[1] == 0x03 and not addresses.isdisjoint(asked)
        return framed(5, 0x83, 0x02) if refused else handle(adu, now)

    world.drives["fan-1"].handle = refuse  # type: ignore[method-assign]


def reads_of(world: World, address: int, since: int) -> int:
    """How often a register was read, after so many other reads."""
    frames = [frame.split() for frame in world.sent("03")[since:]]
    spans = [(int(f[2] + f[3], 16), int(f[4] + f[5], 16)) for f in frames]
    return sum(at <= address < at + count for at, count in spans)


def test_a_register_that_a_drive_has_not_costs_its_neighbours_nothing() -> None:
    world = without(0x2B)
    world.run(3)
    for name in NEIGHBOURS:
        seen = {s.quality for s in world.samples(f"fan-1.{name}")}
        there = name != "scan_count"
        assert seen <= {Quality.WAITING, Quality.GOOD if there else Quality.REFUSED}, name
        assert world.samples(f"fan-1.{name}")[-1].quality is (Quality.GOOD if there else Quality.REFUSED)
    assert world.samples("fan-1.scan_count")[-1].reason == "the drive answers 02H illegal_address"
    before = len(world.sent("03"))
    world.run(20)
    assert reads_of(world, 0x2B, before) == 0
    assert reads_of(world, 0x28, before) > 10
    assert reads_of(world, 0x2C, before) > 10


def test_it_is_found_in_few_reads_and_told_once() -> None:
    world = without(0x2B)
    world.run(40)
    frames = [frame for frame in world.sent("03") if frame.startswith("05 03 00 2B")]
    assert len(frames) <= 2
    assert world.events().count("register_refused") == 1
    [found] = health(world)
    assert (found.first, found.last, found.code, found.points) == (0x2B, 0x2B, 0x02, ("scan_count",))
    assert "fan-1 answers 02H for 002BH (scan_count)" in found.text
    world.feed(Asked(world.session, AskDemand(997, "fan-1.scan_count")))
    demand = next(m.demand for m in world.told[world.session] if isinstance(m, DemandIs))
    assert (demand.reading, [gap.first for gap in demand.gaps]) == (None, [0x2B])


def test_all_bits_of_a_missing_word_and_two_apart_are_found() -> None:
    world = without(0x28, 0x2C)
    world.run(5)
    assert [(gap.first, len(gap.points) > 1) for gap in health(world)] == [(0x28, False), (0x2C, True)]
    good = [world.samples(f"fan-1.{name}")[-1].quality is Quality.GOOD for name in NEIGHBOURS]
    assert good == [True, False, True, False, True]


def test_it_is_remembered_asked_again_once_a_minute_and_read_when_it_is_there() -> None:
    world = without(0x2B)
    world.run(5)
    world = World(make_site(), memory=world.memory())
    lacking = {0x2B}
    lacks(world, lacking)
    world.watch({f"fan-1.{name}": 0.5 for name in NEIGHBOURS})
    world.run(20)
    assert reads_of(world, 0x2B, 0) == 0
    assert world.samples("fan-1.scan_count")[-1].quality is Quality.REFUSED
    assert world.samples("fan-1.output_current")[-1].quality is Quality.GOOD
    world.run(115)
    assert reads_of(world, 0x2B, 0) == 2
    lacking.clear()
    world.run(65)
    assert world.samples("fan-1.scan_count")[-1].quality is Quality.GOOD
    assert health(world) == ()
    assert world.memory().gaps.refused["fan-1"] == []


def test_whoever_comes_later_is_told_too_and_so_is_he_after_a_loss() -> None:
    world = without(0x2B)
    world.run(5)
    world.drives["fan-1"].connected = False
    world.run(10)
    world.drives["fan-1"].connected = True
    world.run(15)
    assert world.samples("fan-1.scan_count")[-1].quality is Quality.REFUSED
    later = world.join()
    world.watch({"fan-1.scan_count": 1.0}, later)
    assert [s.quality for s in world.samples("fan-1.scan_count", later)] == [Quality.REFUSED]


def test_a_plan_on_paper_leaves_it_out() -> None:
    world = without(0x2B)
    world.run(5)
    [plan] = line_plans(make_site(), known=world.memory().gaps)
    blocks = [read.block for read in plan.forecast.reads]
    assert not any(b.address <= 0x2B < b.address + b.count for b in blocks)
    assert any(b.address <= 0x2A < b.address + b.count for b in blocks)


def test_a_refusal_of_another_kind_is_no_missing_register() -> None:
    world = World(make_site())
    handle = world.drives["fan-1"].handle
    world.drives["fan-1"].handle = (  # type: ignore[method-assign]
        lambda adu, now: framed(5, 0x83, 0x22) if adu[1] == 0x03 else handle(adu, now)
    )
    world.watch({"fan-1.output_current": 0.5})
    world.run(5)
    assert health(world) == ()
    assert world.samples("fan-1.output_current")[-1].quality is Quality.REFUSED


def test_a_drive_that_refuses_a_block_but_none_of_its_parts_is_not_asked_for_ever() -> None:
    world = World(make_site())
    handle = world.drives["fan-1"].handle

    def narrow(adu: bytes, now: float) -> bytes | None:
        """Takes no read of more than one register of these."""
        wide = adu[1] == 0x03 and adu[2:4] == b"\x00\x27" and adu[5] > 1
        return framed(5, 0x83, 0x02) if wide else handle(adu, now)

    world.drives["fan-1"].handle = narrow  # type: ignore[method-assign]
    world.watch({"fan-1.output_current": 1.0, "fan-1.output_voltage": 1.0})
    world.run(30)
    assert health(world) == ()
    assert len([frame for frame in world.sent("03") if frame.startswith("05 03 00 27 00 01")]) <= 2


def test_what_is_read_once_is_read_apart() -> None:
    world = World(make_site())
    lacks(world, {0x2B})
    world.run(1)
    samples = world.read(*(f"fan-1.{name}" for name in NEIGHBOURS))
    wanted = [Quality.GOOD, Quality.GOOD, Quality.REFUSED, Quality.GOOD, Quality.GOOD]
    assert [sample.quality for sample in samples] == wanted


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
