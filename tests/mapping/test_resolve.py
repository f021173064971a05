"""From the shape to the profile: kinds, inheritance, repeats, notations, conditions, commands."""

from __future__ import annotations

from fractions import Fraction

import pytest

from gateway.mapping.kinds import KINDS
from gateway.mapping.profile import Access, Argument, Constant, Kind, NumberType, Table
from gateway.tag import Role, ValueType
from tests.mapping.texts import good, load_text, small


@pytest.mark.parametrize("kind", Kind)
def test_a_kind_gives_the_defaults(kind: Kind) -> None:
    point = good(small(f"probe: 0000H\na: {{at: 0001H, kind: {kind}}}")).points["a"]
    assert (point.access, point.role, point.rate) == KINDS[kind]
    assert point.by_command_only == (kind is Kind.COMMAND)


def test_access_can_be_narrowed() -> None:
    points = good(small("state: {at: 0001H, kind: command, access: read}\n"
                        "order: {at: 0001H, kind: command, access: write}")).points  # fmt: skip
    assert points["state"].role is None and not points["state"].by_command_only
    assert points["order"].access is Access.WRITE


def test_the_nearest_key_wins() -> None:
    text = small("a: 0001H\nb: {at: 0002H, unit: 0.1 A}\n"
                 "w: {at: 0003H, rate: fast, bits: {x: 0..3, y: {bit: 4..7, rate: slow}}}")  # fmt: skip
    text = text.replace("    points:", "    rate: normal\n    type: s16\n    points:", 1)
    points = good(text).points
    assert points["a"].encoding.symbol is None
    assert points["b"].encoding.symbol == "A"
    assert {name: point.rate for name, point in points.items()} == {
        "a": "normal", "b": "normal", "x": "fast", "y": "slow",
    }  # fmt: skip
    assert all(point.encoding.type is NumberType.S16 for point in points.values())


REPEATS = """\
a_<n>: {at: 0010H, repeat: 1..3, type: u32}
b_<n>: {at: 0020H, repeat: 5..6, stride: 4}
w:
  at: 0030H
  bits:
    c_<n>: {bit: 0..1, repeat: 1..4}
    d_<n>: {bit: 8, repeat: 1..2, stride: 4}
"""


def test_repeats_lie_next_to_each_other() -> None:
    points = good(small(REPEATS)).points
    assert [points[f"a_{n}"].address for n in (1, 2, 3)] == [0x10, 0x12, 0x14]
    assert [points[f"b_{n}"].address for n in (5, 6)] == [0x20, 0x24]
    assert [points[f"c_{n}"].encoding.bit for n in (1, 2, 3, 4)] == [0, 2, 4, 6]
    assert [points[f"d_{n}"].encoding.bit for n in (1, 2)] == [8, 12]
    assert points["a_3"].notation == "0014H"


NOTATIONS = """\
addresses:
  P.<n>: {n: 1, example: P.162 = 00A2H}
  <g>-<i>: {g: 1000, i: 10, add: -1, example: 16-14 = 3F0BH}
  reg <n>: {n: 1, add: -1, example: reg 9 = 0008H}
  3<n>: {table: input, n: 1, add: -1, example: 30001 = 0000H}
"""


def test_notations_of_several_makers() -> None:
    text = small(
        "a: P.37\nb: 16-14\nc: reg 10\nd: 30005\ne: 0107H\np_<n>: {at: 16-20, repeat: 1..2, stride: 10}",
        NOTATIONS,
    )
    points = good(text.replace("[03H,", "[03H, 04H,")).points
    where = {name: (point.table, point.address, point.notation) for name, point in points.items()}
    assert where == {
        "a": (Table.HOLDING, 37, "P.37"),
        "b": (Table.HOLDING, 16139, "16-14"),
        "c": (Table.HOLDING, 9, "reg 10"),
        "d": (Table.INPUT, 4, "30005"),
        "e": (Table.HOLDING, 0x107, "0107H"),
        "p_1": (Table.HOLDING, 16199, "16-20"),
        "p_2": (Table.HOLDING, 16209, "16-21"),
    }


@pytest.mark.parametrize(
    ("text", "words", "kind"),
    [
        ("u16", 1, ValueType.INTEGER),
        ("s32", 2, ValueType.INTEGER),
        ("u64", 4, ValueType.INTEGER),
        ("f32", 2, ValueType.NUMBER),
        ("bcd", 1, ValueType.INTEGER),
        ("text 5", 3, ValueType.TEXT),
        ("text 20", 10, ValueType.TEXT),
    ],
)
def test_types(text: str, words: int, kind: ValueType) -> None:
    encoding = good(small(f"a: {{at: 0001H, type: {text}, words: low_first}}")).points["a"].encoding
    assert (encoding.words, encoding.value_type, encoding.word_order) == (words, kind, "low_first")


def test_numbers_of_a_value() -> None:
    text = small(
        "a: {at: 0001H, type: s16, unit: 10/1023 V, times: factor, offset: -7.26, special: {FFFFH: off}}"
    )
    text = text.replace("special: {FFFFH: off}", "special: {-1: off}").replace(
        "groups", "settings: {factor: {default: 2}}\ngroups"
    )
    encoding = good(text).points["a"].encoding
    assert (encoding.scale, encoding.times, encoding.offset) == (
        Fraction(10, 1023),
        "factor",
        Fraction("-7.26"),
    )
    assert dict(encoding.special) == {-1: "off"}


def test_values_are_shared_by_name() -> None:
    shared = "values: {mode: {00B: off, 11B: {name: full, doubt: guessed}}}\n"
    field = "w: {at: 0002H, bits: {b: {bit: 0..1, values: mode, active: low}}}"
    text = small(f"a: {{at: 0001H, values: mode}}\n{field}", shared)
    points = good(text).points
    assert dict(points["a"].encoding.values) == dict(points["b"].encoding.values) == {0: "off", 3: "full"}
    assert points["b"].encoding.active_low


def test_a_doubt_about_one_value_is_a_doubt_about_the_point() -> None:
    values = "{0: off, 1: {name: on, source: s 4}, 2: {name: odd, doubt: guessed}}"
    text = small(f"a: {{at: 0001H, doubt: rarely read, values: {values}}}")
    assert good(text).points["a"].provenance.doubt == (
        "rarely read; on: from s 4, a similar model; odd: guessed"
    )  # fmt: skip


def test_provenance_covers_what_is_below() -> None:
    text = small("a: 0001H\nb: {at: 0002H, source: m 7, doubt: own}")
    text = text.replace("    points:", "    source: s 3.1 (2)\n    doubt: group\n    points:", 1)
    points = good(text).points
    assert (points["a"].provenance.document, points["a"].provenance.place) == ("s", "3.1 (2)")
    assert points["a"].provenance.similar and points["a"].provenance.doubt == "group"
    assert (points["b"].provenance.document, points["b"].provenance.doubt) == ("m", "own")
    assert not points["b"].provenance.similar
    assert good(small("a: 0001H")).points["a"].provenance.document == "m"


CONDITIONS = """\
mode: {at: 0001H, values: {0: line, 1: panel, 2: both}}
speed: {at: 0002H, unit: 0.01 Hz}
a:
  at: 0003H
  kind: switch
  only_when: {mode: [line, both], speed: 0..0.5, choice: no, free: 0FH}
"""
CHOICES = "settings: {choice: {values: {0: no, 1: yes}, default: yes}, free: {default: 3}}\n"


def test_conditions_know_points_settings_ranges_and_lists() -> None:
    text = small(CONDITIONS, CHOICES)
    profile = good(text)
    terms = {term.name: term for term in profile.points["a"].only_when}
    assert terms["mode"].ranges == ((0, 0), (2, 2))
    assert terms["mode"].text == "mode: [line, both]"
    assert terms["speed"].ranges == ((0, Fraction(1, 2)),)
    assert terms["choice"].ranges == ((0, 0),) and terms["choice"].setting
    assert terms["free"].ranges == ((15, 15),)
    assert profile.settings["choice"].default == 1


def test_only_when_of_what_is_read_only_is_left_out() -> None:
    text = small("a: 0001H\nb: {at: 0002H, kind: switch}").replace(
        "    points:", "    only_when: {a: 0}\n    points:", 1
    )
    points = good(text).points
    assert points["a"].only_when == ()
    assert [term.name for term in points["b"].only_when] == ["a"]


ORDERS = """\
a: {at: 0001H, kind: command, values: {0: no, 1: yes}}
b: {at: 0002H, kind: setpoint, type: s16, unit: 0.1 Hz, range: -50..50}
p: {at: 0010H, kind: parameter, wear: unknown}
"""
COMMANDS = """\
commands:
  go:
    args: {f: b}
    steps:
      - write: {a: yes, b: -<f>}
      - {write: {p: 3}, within: 200ms}
  stop: {steps: [{write: {b: 0.5}}]}
"""


def test_commands_take_constants_arguments_and_signs() -> None:
    text = small(ORDERS) + COMMANDS
    commands = good(text).commands
    first, second = commands["go"].steps
    assert dict(first.write) == {"a": Constant(Fraction(1)), "b": Argument("f", negate=True)}
    assert (first.until, first.within, second.within) == ((), 1.0, 0.2)
    assert commands["go"].role is Role.ENGINEER and not commands["go"].urgent
    assert commands["stop"].role is Role.OPERATOR and commands["stop"].urgent
    assert dict(commands["stop"].steps[0].write) == {"b": Constant(Fraction(1, 2))}


def test_fields_of_one_word_and_its_neighbour_are_one_step() -> None:
    text = small(
        "w: {at: 0001H, kind: command, image: true, bits: {x: 0, y: 1}}\nb: {at: 0002H, kind: command}"
    )
    good(text + "commands: {go: {steps: [{write: {b: 1, y: true, x: false}}]}}\n")


def test_the_probe_is_the_first_status_point() -> None:
    text = small("m: {at: 0001H, kind: measurement}\ns: 0002H\nt: 0003H")
    assert good(text).modbus.probe == "s"
    assert (
        good(text.replace("[03H,", "[03H, 08H,").replace("10H]}", "10H], probe: loop_back}")).modbus.probe
        == "loop_back"
    )


def test_what_a_profile_may_leave_out() -> None:
    profile = good(small("a: 0001H"))
    assert (profile.serial.units, profile.serial.gap, profile.serial.reply_max) == ((1, 247), 0.0, 1.0)
    assert (profile.modbus.read_max, profile.modbus.write_max, profile.modbus.write_one) == (125, 123, 0x06)
    assert {code: error.name for code, error in profile.errors.items()}[2] == "illegal_address"
    assert profile.commands == {}


def test_danger_counts_raw_values() -> None:
    point = good(
        small("a: {at: 0001H, kind: parameter, wear: 1000, danger: {1110B..1111B: it starts over}}")
    ).points["a"]
    assert dict(point.danger) == {14: "it starts over", 15: "it starts over"}
    assert point.wear == 1000


def test_findings_stand_in_the_order_of_the_file() -> None:
    text = small("b: {at: 0001H, kind: setpoint}\na: {at: zz, kidn: x}\nB: 0003H", "likes: no\n")
    _, findings = load_text(text)
    assert [finding.line for finding in findings] == sorted(finding.line for finding in findings)
    assert len(findings) == 5, "both mistakes in `a`, and one in each other line"
