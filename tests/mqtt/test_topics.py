"""Topics: the default rule, the names that a site gives, and what can stand in a topic."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gateway.bridge.api import DriveInfo
from gateway.northbound.mqtt.levels import TopicError, check_level, check_levels
from gateway.northbound.mqtt.topics import BRANCHES, Target, Topics
from tests.fakes import small_catalogue
from tests.northbound import named_catalogue

FAN = small_catalogue().drives[0]
TOPICS = Topics("plant7", "gw1", [FAN])
LINE = small_catalogue().lines[0]
NAMED = Topics("plant7", "gw1", named_catalogue().drives)
level = st.from_regex(r"[a-z0-9_-]{1,8}", fullmatch=True)
levels = st.lists(level, min_size=1, max_size=3).map("/".join)


def drive(name: str, topic: str = "", **points: str) -> DriveInfo:
    """A drive with these points and their topics."""
    infos = tuple(msgspec.structs.replace(FAN.points[0], name=p, topic=t) for p, t in points.items())
    return msgspec.structs.replace(FAN, name=name, topic=topic, points=infos, commands=())


def test_the_default_rule() -> None:
    assert TOPICS.state("fan-1", "running") == "plant7/fan-1/state/running"
    assert TOPICS.command("plant7/fan-1/cmd/stop") == Target("fan-1", "stop", "stop")
    assert TOPICS.commands == ("plant7/fan-1/cmd/#",)
    assert TOPICS.event("fan-1") == "plant7/fan-1/event"
    assert TOPICS.event("") == "plant7/_gateway/gw1/event"


def test_a_line_takes_commands_to_all_its_drives() -> None:
    topics = Topics("plant7", "gw1", [FAN], [LINE])
    tree = "plant7/_gateway/gw1/lines/north"
    assert topics.commands == ("plant7/fan-1/cmd/#", f"{tree}/cmd/#")
    target = topics.command(f"{tree}/cmd/stop_all")
    assert target == Target("_north", "stop_all", "stop_all")
    assert topics.ack(target) == f"{tree}/ack/stop_all"
    assert topics.command(f"{tree}/cmd/lease") == Target("_north", "", "lease")
    assert topics.meta("_north") == f"{tree}/meta"


def test_a_line_without_commands_takes_none() -> None:
    topics = Topics("plant7", "gw1", [FAN], [msgspec.structs.replace(LINE, commands=())])
    assert topics.commands == ("plant7/fan-1/cmd/#",)
    assert topics.command("plant7/_gateway/gw1/lines/north/cmd/stop_all") is None


def test_the_names_that_a_site_gives() -> None:
    assert NAMED.state("fan-1", "output_frequency") == "hall2/fan/state/speed/hz"
    assert NAMED.state("fan-1", "running") == "hall2/fan/state/running"
    assert NAMED.meta("fan-1") == "hall2/fan/meta"
    assert NAMED.commands == ("hall2/fan/cmd/#",)
    stop = NAMED.command("hall2/fan/cmd/halt")
    assert stop == Target("fan-1", "stop", "halt")
    assert NAMED.ack(stop) == "hall2/fan/ack/halt"


def test_a_name_is_no_command_where_the_site_calls_it_otherwise() -> None:
    assert NAMED.command("hall2/fan/cmd/stop") == Target("fan-1", "", "stop")
    assert NAMED.command("plant7/fan-1/cmd/stop") is None


@settings(deadline=None)
@given(levels, st.dictionaries(level, levels, min_size=1, max_size=3))
def test_a_command_topic_names_its_drive_and_point(tree: str, points: dict[str, str]) -> None:
    try:
        topics = Topics("site", "gw1", [drive("d", f"x/{tree}", **points)])
    except TopicError:
        assert len(set(points.values())) < len(points)
        return
    for name, place in points.items():
        target = topics.command(f"x/{tree}/cmd/{place}")
        assert target == Target("d", name, place)
        assert topics.ack(target) == f"x/{tree}/ack/{place}"
        assert topics.state("d", name) == f"x/{tree}/state/{place}"


@pytest.mark.parametrize(
    "topic", ["plant8/fan-1/cmd/x", "plant7/fan-1/ack/x", "plant7/fan-1/cmd", "plant7//cmd/x", "plant7"]
)
def test_other_topics_are_no_commands(topic: str) -> None:
    assert TOPICS.command(topic) is None


@pytest.mark.parametrize("name", ["", "a b", "+", "#", "a\0", "a\n", "a/"])
def test_names_that_no_broker_takes(name: str) -> None:
    for check in (check_level, check_levels, lambda text: Topics(text, "gw1")):
        with pytest.raises(TopicError):
            check(name)
    with pytest.raises(TopicError):
        Topics("plant7", "gw1", [drive("a", name or "/")])


@pytest.mark.parametrize(
    ("drives", "word"),
    [
        ([drive("_gateway")], "rename"),
        ([drive("a", "plant7/_gateway/gw1")], "gateway's own"),
        ([drive("a", "$SYS/a")], "broker"),
        ([drive("a", "hall"), drive("b", "hall")], "mix"),
        ([drive("a", p="same", q="same")], "p and q"),
        ([drive("a", p="q", q="")], "p and q"),
        *(([drive("a", "hall"), drive("b", f"hall/{branch}")], "mix") for branch in BRANCHES),
        ([drive("b", "hall/cmd/b"), drive("a", "hall")], "mix"),
    ],
)
def test_topics_that_would_mean_two_things_are_refused(drives: list[DriveInfo], word: str) -> None:
    with pytest.raises(TopicError, match=word):
        Topics("plant7", "gw1", drives)


def test_a_drives_tree_may_lie_in_anothers() -> None:
    topics = Topics("plant7", "gw1", [drive("a", "hall", p=""), drive("b", "hall/b", p="")])
    found: list[Any] = [topics.command(topic) for topic in ("hall/cmd/p", "hall/b/cmd/p")]
    assert [target.drive for target in found] == ["a", "b"]


def test_a_site_cannot_have_the_brokers_topics() -> None:
    with pytest.raises(TopicError, match="broker"):
        Topics("$SYS", "gw1")


@pytest.mark.parametrize(
    ("topic", "allowed"),
    [
        ("me/answers", True),
        ("plant77/x", True),
        ("hall2/fan2/x", True),
        ("plant7", False),
        ("plant7/fan-1/cmd/stop", False),
        ("plant7/fan-1/state/running", False),
        ("hall2/fan", False),
        ("hall2/fan/cmd/halt", False),
        ("$share/x", False),
        ("me/+", False),
        ("#", False),
        ("", False),
    ],
)
def test_answers_go_only_where_they_can_forge_nothing(topic: str, allowed: bool) -> None:
    assert NAMED.foreign(topic) is allowed
