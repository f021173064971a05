"""Payloads, settings and the outbox."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gateway.bridge.api import DriveState
from gateway.northbound.mqtt import outbox as outbox_module
from gateway.northbound.mqtt import payload
from gateway.northbound.mqtt.message import Lane, Message
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.settings import SettingsError, settings_of
from gateway.tag import Cause, Outcome, Quality, Sample, Verdict
from tests.fakes import small_catalogue
from tests.mqtt.conftest import section
from tests.northbound import named_catalogue

FAN = small_catalogue().drives[0]
POINTS = {point.name: point for point in FAN.points}
TIME = 1_800_000_000_123_456_789


def test_state_of_a_number() -> None:
    sample = Sample("fan-1.output_frequency", 49.98, Quality.GOOD, TIME)
    assert json.loads(payload.state(sample, POINTS["output_frequency"], 7)) == {
        "v": 49.98,
        "q": "good",
        "ts": "2027-01-15T08:00:00.123Z",
        "u": "Hz",
        "seq": 7,
    }


def test_state_of_a_bit_and_of_an_enumeration() -> None:
    bit = json.loads(payload.state(Sample("fan-1.running", True, Quality.GOOD, TIME), POINTS["running"], 1))
    assert bit["v"] is True
    mode = Sample("fan-1.run_source", 1, Quality.GOOD, TIME)
    assert json.loads(payload.state(mode, POINTS["run_source"], 1))["t"] == "operator_or_terminals"


def test_a_bad_state_has_no_value_even_if_the_sample_has_one() -> None:
    sample = Sample("fan-1.running", True, Quality.LINE_DOWN, TIME, reason="unplugged")
    state = json.loads(payload.state(sample, POINTS["running"], 1))
    assert (state["v"], state["q"], state["cause"], state["reason"]) == (
        None,
        "bad",
        "line_down",
        "unplugged",
    )


def test_a_stale_state_keeps_its_value_and_says_so() -> None:
    sample = Sample("fan-1.output_frequency", 50.0, Quality.STALE, TIME, reason="3 s old")
    state = json.loads(payload.state(sample, POINTS["output_frequency"], 1))
    assert (state["v"], state["q"], state["cause"]) == (50.0, "uncertain", "stale")


def test_data_says_the_time_once_unless_it_differs() -> None:
    pairs = [
        (Sample("fan-1.output_frequency", 1.0, Quality.GOOD, TIME), POINTS["output_frequency"]),
        (Sample("fan-1.running", True, Quality.GOOD, TIME - 10**9), POINTS["running"]),
    ]
    assert json.loads(payload.data(pairs, 3, skipped=2)) == {
        "seq": 3,
        "ts": "2027-01-15T08:00:00.123Z",
        "skipped": 2,
        "values": {
            "output_frequency": {"v": 1.0, "q": "good"},
            "running": {"v": True, "q": "good", "ts": "2027-01-15T07:59:59.123Z"},
        },
    }


def test_meta_of_a_line_tells_what_all_its_drives_can_be_told() -> None:
    meta = json.loads(payload.line_meta(small_catalogue().lines[0], "gw1"))
    assert (meta["gateway"], meta["title"]) == ("gw1", "Line north")
    assert list(meta["commands"]) == ["stop_all", "run_forward_all"]


def test_meta_tells_what_a_client_needs_to_know() -> None:
    meta = json.loads(payload.meta(FAN, "gw1", ["output_frequency"]))
    setpoint = meta["points"]["frequency_command"]
    assert setpoint["range"] == [0.0, 60.0]
    assert (setpoint["unit"], setpoint["access"], setpoint["role"]) == ("Hz", "read-write", "operator")
    assert (setpoint["register"], setpoint["published"]) == ("0002H", False)
    assert meta["points"]["output_frequency"]["published"] is True
    assert meta["points"]["run_source"]["values"] == {"0": "line", "1": "operator_or_terminals"}
    argument = meta["commands"]["run_forward"]["args"]["frequency"]
    assert argument == {"type": "number", "unit": "Hz", "range": [0.0, 60.0], "point": "frequency_command"}


def test_meta_tells_topics_that_are_not_the_name() -> None:
    meta = json.loads(payload.meta(named_catalogue().drives[0], "gw1", []))
    assert meta["points"]["output_frequency"]["topic"] == "speed/hz"
    assert "topic" not in meta["points"]["running"]
    assert meta["commands"]["stop"]["topic"] == "halt"
    assert "topic" not in meta["commands"]["run_forward"]


def test_an_answer_says_false_and_zero_read_back() -> None:
    for value in (False, 0, 0.0):
        answer = json.loads(payload.outcome(1, Outcome(verdict=Verdict.CONFIRMED, value=value), TIME))
        assert answer["v"] == value
    refused = Outcome(verdict=Verdict.REFUSED, cause=Cause.DRIVE_REFUSED, code=0, drive_error="locked")
    answer = json.loads(payload.outcome(None, refused, TIME))
    assert (answer["id"], answer["code"], answer["error"]) == (None, 0, "locked")


def test_drive_status() -> None:
    lost = DriveState("fan-1", up=False, time=TIME, reason="no answer")
    assert json.loads(payload.drive_status(lost)) == {
        "status": "offline",
        "ts": "2027-01-15T08:00:00.123Z",
        "reason": "no answer",
    }


# ---- settings


@pytest.mark.parametrize(
    ("url", "port", "tls", "websocket"),
    [
        ("mqtt://h", 1883, False, False),
        ("mqtts://h", 8883, True, False),
        ("ws://h:9001/x", 9001, False, True),
        ("wss://h", 443, True, True),
        ("mqtt://[::1]:1884", 1884, False, False),
    ],
)
def test_broker_addresses(url: str, port: int, tls: bool, websocket: bool) -> None:
    broker = settings_of(section(1, broker=url)).broker
    assert (broker.port, broker.tls, broker.websocket) == (port, tls, websocket)


@pytest.mark.parametrize("url", ["http://h", "mqtt://", "h:1883", "mqtt://h:99999", "mqtt://u:secret@h"])
def test_what_is_no_broker_address(url: str) -> None:
    with pytest.raises(SettingsError) as caught:
        settings_of(section(1, broker=url))
    assert "secret" not in str(caught.value)


def test_a_password_that_everybody_can_read_is_not_used(tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text("s3cret\n")
    broker = settings_of(section(1, password_file=str(file))).broker
    file.chmod(0o644)
    with pytest.raises(SettingsError, match="chmod"):
        broker.password()
    file.chmod(0o600)
    assert broker.password() == "s3cret"


# ---- outbox


def drain(outbox: Outbox) -> list[str]:
    return [message.payload.decode() for message in iter(outbox.take, None)]


def test_nothing_is_given_out_without_a_connection() -> None:
    outbox = Outbox()
    outbox.retain("s", b"1")
    assert outbox.take() is None


def test_on_connecting_everything_retained_comes_again_and_the_birth_last() -> None:
    outbox = Outbox()
    outbox.retain("a", b"a1")
    outbox.connected(("birth", b"b1"))
    assert drain(outbox) == ["a1", "b1"]
    outbox.disconnected()
    outbox.retain("z", b"z1")
    outbox.retain("a", b"a2")
    outbox.connected(("birth", b"b2"))
    assert drain(outbox)[-1] == "b2"
    outbox.disconnected()
    outbox.connected(("birth", b"b3"))
    assert sorted(drain(outbox)) == ["a2", "b3", "z1"]


def test_answers_overtake_states_and_states_data() -> None:
    outbox = Outbox()
    outbox.connected(("birth", b"birth"))
    outbox.put(Message("d", b"data", Lane.DATA))
    outbox.put(Message("a", b"answer", Lane.ANSWER))
    assert drain(outbox) == ["answer", "birth", "data"]


def test_only_the_latest_state_waits_but_every_data_message_while_connected() -> None:
    outbox = Outbox()
    outbox.connected(("birth", b"birth"))
    for number in range(3):
        outbox.retain("s", f"s{number}".encode())
        outbox.put(Message("d", f"d{number}".encode(), Lane.DATA))
    assert drain(outbox) == ["birth", "s2", "d0", "d1", "d2"]


def test_unconfirmed_answers_come_again_before_newer_ones() -> None:
    outbox = Outbox()
    outbox.connected(("birth", b"birth"))
    first = Message("a", b"first", Lane.ANSWER)
    outbox.put(first)
    drain(outbox)
    outbox.put(Message("a", b"second", Lane.ANSWER))
    outbox.put(Message("d", b"d1", Lane.DATA))
    outbox.put(Message("d", b"d2", Lane.DATA))
    outbox.disconnected([first, Message("d", b"d0", Lane.DATA)])
    outbox.connected(("birth", b"birth"))
    assert drain(outbox) == ["first", "second", "birth", "d2"]


def test_a_cleared_topic_is_removed_from_the_broker_and_forgotten() -> None:
    outbox = Outbox()
    outbox.retain("old", b"1")
    outbox.clear("old")
    outbox.connected(("birth", b"birth"))
    assert drain(outbox) == ["", "birth"]
    outbox.disconnected()
    outbox.connected(("birth", b"birth"))
    assert drain(outbox) == ["birth"]


def test_while_the_broker_is_away_memory_is_bounded() -> None:
    outbox = Outbox()
    for number in range(3 * outbox_module.LIMIT):
        outbox.put(Message("e", str(number).encode(), Lane.ANSWER))
        outbox.put(Message("d", b"data", Lane.DATA))
        outbox.retain("s", b"state")
    assert len(outbox) == outbox_module.LIMIT + 2
    assert outbox.dropped == 2 * outbox_module.LIMIT
