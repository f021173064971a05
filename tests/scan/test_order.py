"""What is tried, in which order, and how long it takes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import settings as limits
from hypothesis import strategies as st

from gateway.modbus.pdu import Request
from gateway.scan.ask import LOOP, Ask, as_delivered, is_plain
from gateway.scan.order import Narrowed, make_plan
from tests.scan.lines import format_of, profiles


def settings(**narrowed: object) -> list[str]:
    plan = make_plan(profiles(), Narrowed(**narrowed), 0.2)  # type: ignore[arg-type]
    return [str(each.setting) for each in plan.rounds]


def test_factory_settings_come_first_and_rtu_before_ascii() -> None:
    order = settings()
    assert order[:3] == ["9600 8N2 rtu", "9600 8E1 rtu", "4800 8N1 rtu"]
    assert (
        order.index("38400 8O1 rtu")
        < order.index("9600 7E1 ascii")
        == min(at for at, setting in enumerate(order) if setting.endswith("ascii"))
    )
    assert len(order) == len(set(order)) == 33


def test_every_setting_of_every_profile_is_tried() -> None:
    order = set(settings())
    for profile in profiles():
        for framing, formats in (("rtu", profile.serial.rtu), ("ascii", profile.serial.ascii)):
            assert {f"{b} {f} {framing}" for b in profile.serial.baud for f in formats} <= order


def test_what_the_user_chose() -> None:
    assert settings(bauds=(57600,), formats=(format_of("8E1"),)) == ["57600 8E1 rtu", "57600 8E1 ascii"]
    assert settings(bauds=(9600,), framings=("ascii",)) == [
        "9600 7E1 ascii",
        "9600 7N2 ascii",
        "9600 7O1 ascii",
    ]
    plan = make_plan(profiles(), Narrowed(units=(7, 3)), 0.2)
    assert {each.units for each in plan.rounds} == {(7, 3)}


def test_a_pseudo_terminal_shows_no_parity() -> None:
    plan = make_plan(profiles(), Narrowed(framings=("rtu",)), 0.2, "pseudo")
    told = [str(each.setting) for each in plan.rounds]
    assert told[:3] == ["9600 8?1 rtu", "9600 8?2 rtu", "4800 8?1 rtu"]
    assert len(told) == len(set(told)) == 11


def test_network_ports_have_units_only() -> None:
    assert [str(each.setting) for each in make_plan(profiles(), Narrowed(), 0.5, "modbus").rounds] == ["tcp"]
    beyond = make_plan(profiles(), Narrowed(), 0.5, "network")
    assert [str(each.setting) for each in beyond.rounds] == ["rtu", "ascii"]


def test_each_profile_is_asked_for_a_register_that_it_has() -> None:
    delivered = [as_delivered(profile) for profile in profiles()]
    for each in make_plan(profiles(), Narrowed(), 0.2).rounds:
        asked = {ask.address for ask in each.asks}
        for profile in delivered:
            if each.setting.known_to(profile) and each.setting.format in (
                *profile.serial.rtu,
                *profile.serial.ascii,
            ):
                has = {p.address for p in profile.points.values() if is_plain(p)}
                assert asked & has, (str(each.setting), profile.name)
        assert len(asked) <= 2


def test_the_time_is_that_of_silent_units() -> None:
    plan = make_plan(profiles()[:1], Narrowed(bauds=(9600,), units=tuple(range(1, 32))), 0.2)
    assert plan.asks == 31
    assert plan.seconds == pytest.approx(31 * (0.2 + (8 + 7 + 3.5) * 11 / 9600), rel=0.01)


def test_registers_that_must_never_be_read_are_not() -> None:
    plan = make_plan(profiles(), Narrowed(), 0.2)
    assert {0x0025, 0x0026, 0x0117} <= plan.forbidden, "holes of the 7200GS"
    assert not [ask for each in plan.rounds for ask in each.asks if ask.address in plan.forbidden]


@limits(deadline=None)
@given(st.builds(Ask, st.integers(0, 0xFF00), st.integers(0, 125)) | st.just(LOOP))
def test_a_scan_can_ask_nothing_but_reads_and_loop_backs(ask: Ask) -> None:
    request: Request = ask.request
    assert request.pdu[0] in (0x03, 0x08)
    assert request.pdu[0] != 0x08 or request.pdu[1:3] == b"\x00\x00"
