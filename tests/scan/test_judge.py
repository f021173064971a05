"""What answers speak for."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from gateway.mapping.condition import Term
from gateway.mapping.profile import Profile
from gateway.modbus.pdu import Reply
from gateway.scan.ask import LOOP, Answer, Ask, as_delivered
from gateway.scan.judge import Reason, suggestions
from gateway.scan.order import Setting
from gateway.scan.signature import checks_of
from tests.scan.lines import profiles
from tests.simulator.plant import shipped

SERIAL = Setting("rtu")


def judged(profile: Profile, answers: dict[Ask, Answer], unit: int = 5) -> list[Reason]:
    (suggestion,) = suggestions([as_delivered(profile)], SERIAL, unit, answers)
    return list(suggestion.reasons)


def words(*values: int) -> Answer:
    return Answer(Reply(values), 0.005)


def test_the_checks_of_the_7200gs() -> None:
    told = [(str(check.ask), check.answered) for check in checks_of(as_delivered(shipped("teco-7200gs")))]
    assert told[:3] == [("08H (loop-back)", False), ("0020H to 0024H", True), ("0027H to 002DH", True)]
    assert [answered for _, answered in told].count(False) == 3


def test_no_check_reads_more_than_a_drive_gives_but_the_one_that_means_to() -> None:
    for profile in profiles():
        checks = checks_of(as_delivered(profile))
        assert all(check.ask.count <= profile.modbus.read_max for check in checks if check.answered)
        assert max(check.ask.count for check in checks) <= profile.modbus.read_max + 1


def test_silence_speaks_against_everything() -> None:
    reasons = judged(shipped("teco-7200gs"), {LOOP: Answer(None), Ask(0x20, 5): Answer(None)})
    assert [reason for reason in reasons if reason.fits] == [Reason(True, "can be set to 9600 8N2 rtu")]
    assert Reason(False, "says nothing to 0020H to 0024H") in reasons


def test_a_refusal_counts_if_its_code_is_known() -> None:
    teco = shipped("teco-7200gs")
    assert Reason(True, "refuses 08H (loop-back) (01H illegal_function)") in judged(
        teco, {LOOP: Answer(Reply(exception=1))}
    )
    assert Reason(False, "refuses 08H (loop-back) (0AH, which its list has not)") in judged(
        teco, {LOOP: Answer(Reply(exception=10))}
    )


def test_the_units_own_number_counts() -> None:
    teco = shipped("teco-7200gs")
    station = teco.points["station_address"].address
    assert Reason(True, "station_address shows 5") in judged(teco, {Ask(station): words(5)})
    assert Reason(False, "station_address shows 6") in judged(teco, {Ask(station): words(6)})


def test_a_value_without_a_name_speaks_against() -> None:
    sl3 = shipped("shihlin-sl3")
    reasons = judged(sl3, {Ask(0x1000): words(77)})
    assert Reason(False, "operation_mode shows 77, which has no name") in reasons


def test_the_marks_of_a_model_count() -> None:
    teco = shipped("teco-7200gs")
    mark = Term("scan_count", ((Fraction(7), Fraction(7)),), "scan_count: 7")
    marked = replace(teco, modbus=replace(teco.modbus, identity=(mark,)))
    address = teco.points["scan_count"].address
    assert Reason(True, "scan_count shows 7") in judged(marked, {Ask(address): words(7)})
    assert Reason(False, "scan_count shows 8") in judged(marked, {Ask(address): words(8)})


def test_a_setting_that_a_drive_has_not_speaks_against_it() -> None:
    assert not SERIAL.known_to(shipped("s2000")) or SERIAL.format.parity == "N"
    other = Setting("rtu", 38400)
    (suggestion,) = suggestions([as_delivered(shipped("teco-7200gs"))], other, 1, {})
    assert suggestion.reasons == (Reason(False, "cannot be set to 38400 8N2 rtu"),)
