"""``gateway demo``, as a person meets it."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.program import GATEWAY, gateway

pytestmark = pytest.mark.xdist_group("demo")


class Demo:
    """A running demo and what it has printed."""

    def __init__(self, process: subprocess.Popen[str], text: str) -> None:
        self.process = process
        self.text = text

    def found(self, pattern: str) -> str:
        """What the pattern's group matches in the demo's words."""
        match = re.search(pattern, self.text)
        assert match is not None, self.text
        return match[1]

    @property
    def site(self) -> Path:
        return Path(self.found(r"site +(\S+)"))


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """A demo that has said all it has to say. The usual OPC UA port is taken, so it has to find another."""
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            taken.bind(("127.0.0.1", 4840))
            taken.listen()
        except OSError:
            pass  # taken by somebody else: as good
        with subprocess.Popen([*GATEWAY, "demo"], stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            text = ""
            for line in process.stdout:
                text += line
                if "Ctrl-C ends" in line:
                    break
            try:
                yield Demo(process, text)
            finally:
                process.kill()


def test_it_names_a_port_that_is_free_and_answers(demo: Demo) -> None:
    port = int(demo.found(r"OPC UA +opc\.tcp://127\.0\.0\.1:(\d+)"))
    assert port != 4840
    assert "4840 was taken" in demo.text
    socket.create_connection(("127.0.0.1", port), 5).close()
    broker = int(demo.found(r"MQTT +mqtt://127\.0\.0\.1:(\d+)"))
    socket.create_connection(("127.0.0.1", broker), 5).close()


def test_it_tells_the_operator_password(demo: Demo) -> None:
    assert demo.found(r"user operator, password ([\w-]{12})\)")


def test_its_first_command_runs_the_motor(demo: Demo) -> None:
    words = demo.found(r"python -m gateway (command .*)").split()
    assert words[-1] == "frequency=60"
    ran = gateway(*words)
    assert ran.code == 0, ran.out
    assert ran.out.startswith("confirmed  ")
    samples = gateway("read", demo.site, "fan-1.running", "--json").objects
    assert samples[0]["value"] is True


def test_it_ends_within_two_seconds_and_leaves_nothing(demo: Demo) -> None:
    folder = demo.site.parent
    ours = [pid for pid in Path("/proc").glob("[0-9]*/cmdline") if str(folder).encode() in _read(pid)]
    assert len(ours) >= 3  # simulator, core, broker
    demo.process.send_signal(signal.SIGINT)
    asked = time.monotonic()
    assert demo.process.wait(10) == 0
    assert time.monotonic() - asked < 2.5
    assert not folder.exists()
    assert not [pid for pid in ours if str(folder).encode() in _read(pid)]


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""
