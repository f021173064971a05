"""Wireshark's own dissectors on our captures, with no setting made by hand: what tshark tells of them."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from gateway.bridge.api import Frame
from gateway.capture.source import Captured, Source
from gateway.capture.wireshark import RTU_PORT, Writer
from tests.capture.runs import eventful, source, trace_of

TSHARK = shutil.which("tshark")
pytestmark = [
    pytest.mark.needs_tshark,
    pytest.mark.skipif(TSHARK is None, reason="tshark is not installed (apt-get install tshark)"),
]
MICROSECOND = 1000


def dissected(
    folder: Path, lines: list[Source], captured: list[Captured], *options: str
) -> list[dict[str, Any]]:
    """The layers of every frame, as tshark tells them of our file."""
    path = folder / "trace.pcapng"
    writer = Writer("gateway test", lines)
    path.write_bytes(writer.head + b"".join(map(writer.frame, captured)))
    assert TSHARK is not None
    command = [TSHARK, "-r", str(path), "-n", "-T", "json", "--no-duplicate-keys", *options]
    done = subprocess.run(
        command, capture_output=True, timeout=60, check=True, env={"HOME": str(folder), "TZ": "UTC"}
    )
    return [packet["_source"]["layers"] for packet in json.loads(done.stdout)]


def nanoseconds(layers: dict[str, Any]) -> int:
    seconds, _, rest = layers["frame"]["frame.time_epoch"].partition(".")
    return int(seconds) * 10**9 + int(rest)


def comment(layers: dict[str, Any]) -> str:
    packet: dict[str, str] = layers.get("Packet comments", layers.get("pkt_comment", {}))
    return packet.get("frame.comment", "")


def test_a_run_in_rtu(tmp_path: Path) -> None:
    life = eventful(tmp_path, "teco-7200gs", "9600 8N2")
    captured = trace_of(life)
    told = dissected(tmp_path, [source(life)], captured)
    assert len(told) == len(captured)
    for (_, frame), layers in zip(captured, told, strict=True):
        assert nanoseconds(layers) == frame.time
        assert layers["frame"]["frame.p2p_dir"] == ("0" if frame.sent else "1")
        assert comment(layers) == frame.note
        whole = frame.note != "damaged"
        assert ("mbrtu" in layers) == whole
        assert ("data" in layers) != whole
        flags = layers["frame"]["frame.packet_flags_tree"]
        assert flags["frame.packet_flags_crc_error"] in (("0", False) if whole else ("1", True))
        if whole:
            assert int(layers["mbrtu"]["mbrtu.unit_id"]) == 5
            assert int(layers["modbus"]["modbus.func_code"]) == frame.data[1] & 0x7F
    frame_layer = told[0]["frame"]
    assert frame_layer["frame.interface_id_tree"]["frame.interface_name"] == "north"
    assert frame_layer["frame.interface_id_tree"]["frame.interface_description"] == (
        "rtu 9600 8N2 on simulated:"
    )


def test_replies_are_paired_with_their_requests(tmp_path: Path) -> None:
    """A reply names the frame of its request, and so its registers have their addresses."""
    life = eventful(tmp_path, "teco-7200gs", "9600 8N2")
    captured = trace_of(life)
    told = dissected(tmp_path, [source(life)], captured)
    paired = 0
    for number, ((_, asked), (_, frame), layers) in enumerate(
        zip(captured, captured[1:], told[1:], strict=False), 1
    ):
        if frame.note != "reply" or frame.data[1] != 3:
            continue
        modbus = layers["modbus"]
        assert int(modbus["modbus.request_frame"]) == number
        elapsed = float(modbus["modbus.response_time"]) * 1e9
        assert elapsed == pytest.approx(frame.time - asked.time, abs=1)
        first = int.from_bytes(asked.data[2:4], "big")
        registers = [tree for key, tree in modbus.items() if key.startswith("Register ")]
        assert [int(tree["modbus.regnum16"]) for tree in registers] == list(
            range(first, first + len(registers))
        )
        words = frame.data[3:-2]
        assert b"".join(int(tree["modbus.regval_uint16"]).to_bytes(2, "big") for tree in registers) == words
        paired += 1
    assert paired > 15


def test_ascii_is_shown_as_what_it_is(tmp_path: Path) -> None:
    """Wireshark dissects no Modbus ASCII: the characters are data, under the right name."""
    life = eventful(tmp_path, "shihlin-sl3", "9600 7E1", "ascii")
    captured = trace_of(life)
    told = dissected(tmp_path, [source(life)], captured)
    for (_, frame), layers in zip(captured, told, strict=True):
        assert bytes.fromhex(layers["data"]["data.data"].replace(":", "")) == frame.data
        tags = layers["exported_pdu"]["exported_pdu.tag_tree"]
        assert "Modbus ASCII" in [tag.get("exported_pdu.col_proto_str") for tag in tags]
        assert comment(layers) == frame.note


TCP = Source("hall", "tcp", "", "modbus://10.0.0.7:502")
WEST = Source("west", "rtu", "19200 8E1", "/dev/ttyUSB1")
AT = 1_795_521_600_123_456_000


def frame(at: int, sent: bool, data: str, note: str) -> Frame:
    return Frame(AT + at * MICROSECOND, sent, bytes.fromhex(data), note)


def test_modbus_tcp_beside_rtu_keeps_the_lines_apart(tmp_path: Path) -> None:
    captured = [
        Captured(TCP, frame(0, True, "000700000006 02 0300200001", "read")),
        Captured(WEST, frame(1, True, "02 03 0024 0001 C432", "read")),
        Captured(TCP, frame(900, False, "000700000005 02 03020004", "reply")),
        Captured(WEST, frame(9000, False, "02 03 02 0BB8 FB06", "reply")),
    ]
    told = dissected(tmp_path, [TCP, WEST], captured)
    assert [layers["frame"]["frame.interface_id_tree"]["frame.interface_name"] for layers in told] == [
        "hall",
        "west",
        "hall",
        "west",
    ]
    assert [("mbtcp" in layers, "mbrtu" in layers) for layers in told] == 2 * [(True, False), (False, True)]
    assert [told[n]["modbus"]["modbus.request_frame"] for n in (2, 3)] == ["1", "2"]
    assert told[2]["modbus"]["Register 32 (UINT16): 4"]["modbus.regnum16"] == "32"


@pytest.mark.parametrize("function", ["06", "08"])
def test_requests_that_look_like_their_replies_need_one_setting(function: str, tmp_path: Path) -> None:
    """Wireshark cannot know the device's end of a serial line; told its port, it can."""
    data = {"06": "02 06 0001 1770 D62D", "08": "02 08 0000 1234 ED4F"}[function]
    captured = [
        Captured(WEST, frame(0, True, data, "write")),
        Captured(WEST, frame(9000, False, data, "reply")),
    ]
    plain = dissected(tmp_path, [WEST], captured)
    assert [int(layers["modbus"]["modbus.func_code"]) for layers in plain] == 2 * [int(function)]
    told = dissected(tmp_path, [WEST], captured, "-o", f"mbrtu.tcp.port:{RTU_PORT}")
    assert "modbus.request_frame" not in told[0]["modbus"]
    assert told[1]["modbus"]["modbus.request_frame"] == "1"
