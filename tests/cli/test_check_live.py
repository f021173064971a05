"""``gateway check --live``: what is said of drives that fit their profile, and of drives that do not."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from gateway.core.core import Core
from gateway.mapping.load import load_site
from gateway.tag import Quality, Sample, Value, tag_of
from gateway.terminal.live import Found, found, found_lines, found_object
from tests.cli.program import GATEWAY, gateway

pytestmark = pytest.mark.xdist_group("live")

PROFILE = """\
profile: {name}
title: Small drive
maker: Nobody
models: [S]
version: 1
documents: {{m: manual}}
serial: {{baud: [9600], rtu: [8N1], reply: 5ms..300ms, comm_loss: {{action: when_lost}}}}
modbus: {{functions: [03H, 06H, 10H]}}
groups:
  g:
    points:
      status: {{at: 0001H, bits: {{running: 0}}}}
      station_address: 0002H
      run_source: {{at: 0003H, values: {{0: line, 1: panel}}}}
      when_lost: {{at: 0004H, values: {{0: coast, 1: keep_running}}}}
      speed_limit: {{at: 0005H, kind: parameter, wear: unknown, unit: 0.1 Hz, range: 10..50}}
      speed: {{at: 0006H, kind: setpoint, unit: 0.1 Hz, range: 0..60}}
      page: {{at: 0007H, kind: setpoint, range: 0..9}}
      on_page: {{at: 0008H, select: {{page: 3}}}}
      {more}
simulate: {{factory: {{0002H: 5, 0003H: {source}, 0004H: {lost}, 0005H: {limit}}}}}
"""
SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: {port}
    serial: 9600 8N1
    drives:
      fan-1: {{profile: {name}, unit: 5, ranges: {{speed: [0, 40]}}, control: {{lease: off}}}}
data: {data}
"""


def write_site(folder: Path, name: str = "small", port: str = "simulated", **facts: Any) -> Path:
    words = {"more": "", "source": 0, "lost": 0, "limit": 300, **facts}
    (folder / f"{name}.yaml").write_text(PROFILE.format(name=name, **words))
    path = folder / f"{name}-site.yaml"
    path.write_text(SITE.format(name=name, port=port, data=folder / name))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def port(folder: Path) -> Iterator[str]:
    """The port of a virtual drive that was made from another profile than the one it is checked against."""
    site = write_site(folder, "real", source=7, lost=1, limit=999)
    words = [*GATEWAY, "simulate", str(site), "--dir", str(folder / "ptys")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        yield line.split()[-1]
        process.send_signal(signal.SIGINT)


def test_h16_a_drive_that_contradicts_its_profile(folder: Path, port: str) -> None:
    site = write_site(folder, "other", port, more="missing: 0100H")
    ran = gateway("check", site, "--live", "--json")
    assert ran.code == 1, ran
    (told,) = [answer for answer in ran.objects if "drive" in answer]
    assert (told["drive"], told["profile"], told["answers"], told["unread"]) == (
        "fan-1",
        "other",
        True,
        ["on_page"],
    )
    assert told["refused"] == ["missing"]
    source, limit, missing = told["contradictions"]
    assert source == "run_source (0003H) is 7, which is none of line, panel"
    assert limit == "speed_limit (0005H) is 99.9 Hz, outside 10.0 Hz to 50.0 Hz"
    assert missing.startswith("missing (0100H) cannot be read: ")
    assert told["comm_loss_action"] == "keep_running"
    assert told["remarks"][0].startswith("the drive keeps running when the line dies")


def test_a_drive_that_is_not_there(folder: Path, port: str) -> None:
    path = write_site(folder, "away", port)
    path.write_text(path.read_text().replace("unit: 5", "unit: 6"))
    ran = gateway("check", path, "--live")
    assert ran.code == 1
    assert "fan-1 (away, unit 6 on north): does not answer" in ran.out
    assert ran.out.count("contradiction: it does not answer") == 1


def test_a_simulated_line_needs_a_gateway_that_runs(folder: Path) -> None:
    ran = gateway("check", write_site(folder), "--live")
    assert ran.code == 1
    assert "line north is simulated, and no gateway is running" in ran.err


GOOD: Mapping[str, Value] = {
    "running": False,
    "station_address": 5,
    "run_source": 0,
    "when_lost": 0,
    "speed_limit": 30.0,
    "speed": 20.0,
    "page": 1,
}


def seen(folder: Path, changed: Mapping[str, Value | Quality] | None = None) -> Found:
    """A look at a drive that shows `GOOD`, but for what is changed; a quality is that of no value."""
    site, findings = load_site(write_site(folder))
    assert site is not None, findings
    info = Core(site, "0").catalogue.drives[0]
    names = {point.name: point.values for point in info.points}
    samples = []
    for name, value in {**GOOD, **(changed or {})}.items():
        quality = value if isinstance(value, Quality) else Quality.GOOD
        shown = None if isinstance(value, Quality) else value
        text = names[name].get(shown) if isinstance(shown, int) else None
        samples.append(Sample(tag_of("fan-1", name), shown, quality, 1, text=text))
    return found(site.drives[0], info, samples)


def test_a_drive_that_fits(folder: Path) -> None:
    good = seen(folder)
    assert good.contradictions == []
    assert list(found_lines(good)) == [
        "fan-1 (small, unit 5 on north): answers",
        "  read: 7 of 7 points have a value",
        "  run_source: line",
        "  when the line dies: coast",
        "  remark: not read, because a selector would have to be written: on_page",
    ]
    assert found_object(good)["sources"] == {"run_source": "line"}


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("station_address", 4, "station_address (0002H) is 4, but the site says unit 5"),
        ("run_source", 2, "run_source (0003H) is 2, which is none of line, panel"),
        ("speed_limit", 9.9, "speed_limit (0005H) is 9.9 Hz, outside 10.0 Hz to 50.0 Hz"),
        ("page", Quality.REFUSED, "page (0007H) cannot be read: refused"),
        ("page", Quality.WAITING, "page (0007H) brought no value: waiting"),
        ("page", Quality.NO_COMMUNICATION, "page (0007H) brought no value: no_communication"),
    ],
)
def test_a_contradiction(folder: Path, name: str, value: Value | Quality, told: str) -> None:
    assert seen(folder, {name: value}).contradictions == [told]


def test_the_bits_of_a_word_that_is_refused_are_one_contradiction(folder: Path) -> None:
    more = "wide: {at: 0009H, bits: {a: 0, b: 1, c: 2..3}}"
    site, findings = load_site(write_site(folder, "bits", more=more))
    assert site is not None, findings
    info = Core(site, "0").catalogue.drives[0]
    samples = [Sample(tag_of("fan-1", name), None, Quality.REFUSED, 1, reason="02H") for name in "abc"]
    samples.append(Sample(tag_of("fan-1", "page"), None, Quality.REFUSED, 1, reason="02H"))
    assert found(site.drives[0], info, samples).contradictions == [
        "a and 2 more (0009H) cannot be read: 02H",
        "page (0007H) cannot be read: 02H",
    ]


def test_an_action_whose_codes_nobody_knows_is_no_promise(folder: Path) -> None:
    path = write_site(folder, "codes")
    profile = folder / "codes.yaml"
    text = profile.read_text().replace(
        "{at: 0004H, values: {0: coast, 1: keep_running}}", "{at: 0004H, doubt: no list}"
    )
    profile.write_text(text)
    site, findings = load_site(path)
    assert site is not None, findings
    info = Core(site, "0").catalogue.drives[0]
    shown = found(site.drives[0], info, [Sample(tag_of("fan-1", "when_lost"), 0, Quality.GOOD, 1)])
    assert "  when the line dies: 0 (no list)" in list(found_lines(shown))


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("speed", 55.0, "speed is 55.0 Hz, outside 0.0 Hz to 40.0 Hz of this site"),
        ("page", Quality.NOT_APPLICABLE, "not there in the present mode: page"),
        ("when_lost", 1, "the drive keeps running when the line dies: nothing can stop it from here then"),
    ],
)
def test_a_remark_is_no_contradiction(folder: Path, name: str, value: Value | Quality, told: str) -> None:
    drive = seen(folder, {name: value})
    assert drive.contradictions == []
    assert told in drive.remarks
