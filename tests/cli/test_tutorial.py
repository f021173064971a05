"""docs/tutorial.md as a reader does it: its files written, its commands run, in order."""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.cli.program import GATEWAY

pytestmark = pytest.mark.xdist_group("tutorial")

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tutorial.md"
BLOCK = re.compile(r"(?:`([\w.-]+)`:\n\n)?```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
SETTLE = 30.0
HERE = {**os.environ, "PYTHONPATH": str(PAGE.parents[1])}
"""So that `python -m gateway` is found from any folder."""


class Ran(NamedTuple):
    """A command of the page, and how it ended."""

    line: str
    code: int
    out: str


class Reader:
    """Somebody who follows the page in a folder of his own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.ran: list[Ran] = []
        self.shown: list[str] = []
        self.gateway: subprocess.Popen[bytes] | None = None

    def follow(self, text: str) -> None:
        for name, language, body in BLOCK.findall(text):
            if language == "yaml":
                (self.folder / name).write_text(body, encoding="utf-8")
            elif language == "sh":
                for line in body.splitlines():
                    self.do(line)
            else:
                self.shown.append(body)

    def do(self, line: str) -> None:
        words = shlex.split(line, comments=True)
        assert words[0] == "gateway"
        if words[1] == "run":
            self.start(words[1:])
        else:
            self.ran.append(self.run(line, words[1:]))

    def run(self, line: str, words: list[str]) -> Ran:
        done = subprocess.run(
            [*GATEWAY, *words],
            cwd=self.folder,
            env=HERE,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        return Ran(line, done.returncode, done.stdout + done.stderr)

    def start(self, words: list[str]) -> None:
        """Leave a gateway running, and go on when its drive answers."""
        with (self.folder / "log").open("wb") as log:
            self.gateway = subprocess.Popen([*GATEWAY, *words], cwd=self.folder, env=HERE, stderr=log)
        limit = time.monotonic() + SETTLE
        while "drive pump-1: up" not in self.run("", ["health", "site.yaml"]).out:
            assert time.monotonic() < limit, "the gateway has not come up"

    def stop(self) -> None:
        if self.gateway is not None:
            self.gateway.send_signal(signal.SIGINT)
            self.gateway.wait(10)

    def answer(self, start: str) -> Ran:
        """The last command that begins so."""
        return next(ran for ran in reversed(self.ran) if ran.line.startswith(f"gateway {start}"))


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reader]:
    """A reader who is through."""
    reader = Reader(tmp_path_factory.mktemp("tutorial"))
    try:
        reader.follow(PAGE.read_text(encoding="utf-8"))
        yield reader
    finally:
        reader.stop()


def test_every_command_does_what_the_page_says(reader: Reader) -> None:
    assert len(reader.ran) >= 14
    for ran in reader.ran:
        assert (ran.code == 0) == ("# refused" not in ran.line), ran


def test_nothing_is_found_wrong(reader: Reader) -> None:
    checks = [ran for ran in reader.ran if ran.line == "gateway check site.yaml"]
    assert [ran.out for ran in checks] == reader.shown * 2


def test_the_profile_says_what_the_page_of_the_manual_says(reader: Reader) -> None:
    shown = reader.answer("profiles").out
    for word in ("40202", "hold time not stated", "run_reverse", "0..max_frequency"):
        assert word in shown, word
    assert "acme-100" in reader.answer("profiles").out


def test_a_tag_is_explained(reader: Reader) -> None:
    told = reader.answer("explain").out
    for word in ("40202 00C9H", "p.41 (um)", "ns=2;s=pump-1.output_frequency", "plant7/pump-1/state/output"):
        assert word in told, told


def test_the_twin_runs_and_fits_its_profile(reader: Reader) -> None:
    assert "50.0 Hz" in reader.answer("read site.yaml pump-1.running").out
    live = reader.answer("check site.yaml --live").out
    assert "pump-1 (acme-100, unit 7 on north): answers" in live
    assert "when the line dies: ramp_down" in live
    assert "contradiction" not in live
    for command in ("command site.yaml pump-1 run_forward", "write site.yaml pump-1.frequency_command=30"):
        assert reader.answer(command).out.startswith("confirmed")
    assert reader.answer("command site.yaml pump-1 stop").out.startswith("confirmed")


def test_the_setpoint_travels_as_the_page_says(reader: Reader) -> None:
    """300 tenths of a hertz to 40102, which is 0065H on the wire."""
    assert re.search(r">> 07 06 00 65 01 2C", reader.answer("trace").out)


def test_refusals_name_their_reason(reader: Reader) -> None:
    too_fast, misspelled = (ran.out for ran in reader.ran if "# refused" in ran.line)
    assert "45" in too_fast
    assert "did you mean run_forward?" in misspelled
