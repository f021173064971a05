"""How fast a point may be changed: what profiles and site files say, and that a site only narrows (T3)."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from gateway.mapping.load import load_site
from gateway.mapping.profile import FREELY, Pace
from gateway.mapping.site import StartGroup
from tests.mapping.texts import good, small

BOUNDS = st.none() | st.fractions(min_value=Fraction(1, 100), max_value=100)
PACES = st.builds(Pace, BOUNDS, BOUNDS, st.floats(0, 100))
SPEED = "{at: 0001H, kind: setpoint, range: 0..50, unit: 0.1 Hz, step: 10, slew: 2, interval: 500ms}"
SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: simulated
    serial: 9600 8N1
    drives:
      fan-1: {profile: small, unit: 1, limits: {speed: {LIMITS}}}
      fan-2: {profile: small, unit: 2}
starts: {hall-2: {drives: [fan-1, fan-2], apart: 5s}}
"""


def load(folder: Path, limits: str) -> list[str] | Pace:
    (folder / "small.yaml").write_text(small(f"speed: {SPEED}"), encoding="utf-8")
    file = folder / "site.yaml"
    file.write_text(SITE.replace("LIMITS", limits), encoding="utf-8")
    site, findings = load_site(file)
    if site is None:
        return [finding.message for finding in findings]
    assert site.starts == (StartGroup("hall-2", ("fan-1", "fan-2"), 5.0),)
    drive = site.drives[0]
    return drive.profile.points["speed"].pace.within(drive.limits["speed"])


def test_a_group_gives_its_pace_to_what_is_written() -> None:
    group = small("speed: {at: 0001H, kind: setpoint, range: 0..50}\nseen: 0002H").replace(
        "    points:", "    interval: 2s\n    points:"
    )
    profile = good(group)
    assert profile.points["speed"].pace == Pace(None, None, 2.0)
    assert profile.points["seen"].pace is FREELY


def test_t3_a_site_narrows_each_bound_by_itself(tmp_path: Path) -> None:
    assert load(tmp_path, "slew: 1") == Pace(Fraction(10), Fraction(1), 0.5)
    assert load(tmp_path, "step: 5, interval: 2s") == Pace(Fraction(5), Fraction(2), 2.0)


def test_t3_a_site_widens_no_bound(tmp_path: Path) -> None:
    messages = load(tmp_path, "step: 11, slew: 3, interval: 100ms")
    assert isinstance(messages, list)
    assert messages[:3] == [
        "the profile allows a step of at most 10",
        "the profile allows a slew of at most 2",
        "the profile wants at least 0.5 s between two writes",
    ]


@given(PACES, PACES)
def test_t3_together_no_bound_is_wider_than_either(one: Pace, other: Pace) -> None:
    both = one.within(other)
    for pace in (one, other):
        assert pace.step is None or (both.step is not None and both.step <= pace.step)
        assert pace.slew is None or (both.slew is not None and both.slew <= pace.slew)
        assert both.interval >= pace.interval
    assert both == other.within(one)
