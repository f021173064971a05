"""Site files: lines, drives, what the adapters get, where profiles are found."""

from __future__ import annotations

import hashlib
import json
from fractions import Fraction
from pathlib import Path

import pytest

from gateway.mapping.load import builtin_mappings, load_profile, load_site
from gateway.mapping.site import Control, Site
from gateway.tag import means
from tests.mapping.texts import PLANT, TECO, small

SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: simulated
    serial: 9600 8N2
    drives:
      fan-1: {profile: teco-7200gs, unit: 5}
"""


OPEN = """\
opcua:
  endpoint: "opc.tcp://[::1]:0"
  security: [none, sign]
  anonymous: read
  users_file: u.yaml
  certificates: /etc/c
"""


def load(folder: Path, text: str) -> Site:
    file = folder / "site.yaml"
    file.write_text(text, encoding="utf-8")
    site, findings = load_site(file)
    assert site is not None, [str(finding) for finding in findings]
    return site


def test_the_example_loads_without_a_finding() -> None:
    site, findings = load_site(PLANT)
    assert findings == []
    assert site is not None
    assert [drive.name for drive in site.drives] == ["fan-1", "pump-2"]
    fan, pump = site.drives
    assert dict(fan.ranges) == {"frequency_command": (0, 50)}
    assert dict(fan.settings) == {"max_frequency": 60}
    assert dict(pump.settings) == {"max_frequency": 50}
    assert fan.profile == pump.profile
    assert site.lines[0].port == "/dev/serial/by-id/usb-FTDI_A1"
    assert (site.lines[0].framing, site.lines[0].baud, str(site.lines[0].format)) == ("rtu", 9600, "8N2")
    assert dict(site.rates) == {"fast": 0.2, "normal": 1.0, "slow": 30.0}
    assert not site.writes_enabled


def test_what_a_site_may_leave_out(tmp_path: Path) -> None:
    site = load(tmp_path, SITE)
    assert (site.opcua, site.mqtt, site.writes_enabled) == (None, (), False)
    assert site.data == tmp_path / "data"
    assert set(site.rates) == {"fast", "normal", "slow"}
    assert site.drives[0].control == Control()


def test_the_opcua_section(tmp_path: Path) -> None:
    site = load(tmp_path, SITE + "opcua: {endpoint: opc.tcp://127.0.0.1:4840}\ndata: var\n")
    assert site.opcua == {
        "endpoint": "opc.tcp://127.0.0.1:4840",
        "security": ["sign_and_encrypt"],
        "anonymous": False,
        "users_file": str(tmp_path / "var" / "users.yaml"),
        "certificates": str(tmp_path / "var" / "certificates"),
    }
    site = load(tmp_path, SITE + OPEN)
    assert site.opcua is not None
    assert (site.opcua["anonymous"], site.opcua["security"]) == (True, ["none", "sign"])
    assert (site.opcua["users_file"], site.opcua["certificates"]) == (str(tmp_path / "u.yaml"), "/etc/c")


def test_the_mqtt_sections(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("x")
    secret.chmod(0o600)
    text = (
        SITE
        + """\
mqtt:
  - {broker: embedded}
  - broker: mqtts://10.0.0.5:8883
    name: plant
    user: gw
    password_file: secret
    client_id: gw-1
    commands: {role: operator}
    publish:
      - {points: [running, "fan-1.out*"], rate: 500ms, deadband: 0.05, max_silence: 60s}
      - {points: ["*"]}
"""
    )
    first, second = load(tmp_path, text).mqtt
    assert first == {
        "name": "mqtt",
        "broker": "embedded",
        "user": None,
        "password_file": None,
        "ca_file": None,
        "client_id": "plant7-gw1-mqtt",
        "commands": None,
        "publish": None,
        "data": str(tmp_path / "data" / "mqtt"),
    }
    assert second["password_file"] == str(secret)
    assert second["commands"] == {"role": "operator"}
    assert second["publish"] == [
        {"points": ["running", "fan-1.out*"], "rate": 0.5, "deadband": 0.05, "max_silence": 60.0},
        {"points": ["*"], "rate": 1.0, "deadband": None, "max_silence": None},
    ]


def test_sections_are_plain_data() -> None:
    site, _ = load_site(PLANT)
    assert site is not None
    assert json.loads(json.dumps([site.opcua, list(site.mqtt)])) == [site.opcua, list(site.mqtt)]


def test_a_password_file_that_everybody_may_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("x")
    secret.chmod(0o644)
    file = tmp_path / "site.yaml"
    file.write_text(SITE + "mqtt: [{broker: embedded, user: gw, password_file: secret}]\n")
    site, findings = load_site(file)
    assert site is None
    assert [str(finding) for finding in findings] == [
        f"{file}:9:52: everybody on this machine may read this file (chmod 640 or stricter)"
    ]


@pytest.mark.parametrize("choice", ["stop", "hold", "{setpoint: 12.5}"])
def test_what_happens_on_expiry_is_chosen(tmp_path: Path, choice: str) -> None:
    control = f"control: {{lease: required, ttl: 5s, on_expiry: {choice}}}"
    text = SITE.replace("unit: 5", f"unit: 5, {control}") + "writes: {enabled: true}\n"
    file = tmp_path / "site.yaml"
    file.write_text(text)
    site, findings = load_site(file)
    assert site is not None and site.writes_enabled
    setpoint = Fraction(25, 2) if "setpoint" in choice else None
    assert site.drives[0].control == Control("required", 5.0, choice.strip("{}"), setpoint)
    assert findings == []


def test_without_a_lease_nothing_expires(tmp_path: Path) -> None:
    text = SITE.replace("unit: 5", "unit: 5, control: {lease: off}") + "writes: {enabled: true}\n"
    assert load(tmp_path, text).drives[0].control.lease == "off"


def test_ports(tmp_path: Path) -> None:
    assert load(tmp_path, SITE).lines[0].port == "simulated:"
    assert load(tmp_path, SITE.replace("simulated", '"simulated:"')).lines[0].port == "simulated:"
    assert load(tmp_path, SITE.replace("simulated", "dev/tty")).lines[0].port == str(tmp_path / "dev/tty")
    assert load(tmp_path, SITE.replace("simulated", "tcp://h:4001")).lines[0].framing == "rtu"
    network = SITE.replace("simulated", "modbus://h:502").replace("    serial: 9600 8N2\n", "")
    assert load(tmp_path, network).lines[0].framing == "tcp"


def test_profiles_are_sought_in_order(tmp_path: Path) -> None:
    listed, extra = tmp_path / "listed", tmp_path / "extra"
    text = SITE.replace("teco-7200gs", "small").replace("8N2", "8N1")
    for number, folder in enumerate([tmp_path, extra, listed]):
        folder.mkdir(exist_ok=True)
        profile = small("running: {at: 0001H, bits: {on: 0}}").replace("version: 1", f"version: {number + 1}")
        (folder / "small.yaml").write_text(profile)
        file = tmp_path / "site.yaml"
        file.write_text(text + "profiles: [listed]\n")
        site, findings = load_site(file, [extra])
        assert site is not None, findings
        assert site.drives[0].profile.version == number + 1


def test_a_profile_name_is_no_path(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(small("a: 0001H"))
    folder = tmp_path / "in"
    folder.mkdir()
    file = folder / "site.yaml"
    file.write_text(SITE.replace("teco-7200gs", "../small"))
    site, findings = load_site(file)
    assert site is None
    assert findings[0].message == "there is no profile `../small`"


def test_findings_of_a_profile_are_told_once_and_stop_the_site(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(small("a: {at: 0001H, unit: Hz}"))
    file = tmp_path / "site.yaml"
    text = SITE.replace("teco-7200gs", "small").replace("8N2", "8N1")
    file.write_text(text + "      fan-2: {profile: small, unit: 6}\n")
    site, findings = load_site(file)
    assert site is None
    assert len(findings) == 1
    assert findings[0].file == str(tmp_path / "small.yaml")


def test_the_digest_covers_site_and_profiles(tmp_path: Path) -> None:
    site = load(tmp_path, SITE)
    assert site.digest == hashlib.sha256(SITE.encode() + TECO.read_bytes()).hexdigest()
    assert load(tmp_path, SITE + "# changed\n").digest != site.digest


def test_a_setting_without_default_must_be_given(tmp_path: Path) -> None:
    profile = small("a: {at: 0001H, kind: setpoint, range: 0..top}", "settings: {top: {range: 0..100}}\n")
    (tmp_path / "small.yaml").write_text(profile)
    file = tmp_path / "site.yaml"
    text = SITE.replace("teco-7200gs", "small").replace("8N2", "8N1")
    file.write_text(text)
    assert [finding.message for finding in load_site(file)[1]] == [
        "the setting `top` of `small` has no default"
    ]
    site = load(tmp_path, text.replace("unit: 5", "unit: 5, settings: {top: 50}"))
    assert dict(site.drives[0].settings) == {"top": Fraction(50)}


def test_files_that_are_not_there(tmp_path: Path) -> None:
    missing = tmp_path / "none.yaml"
    words = f"{missing}:1:1: cannot be read: No such file or directory (check the path and its rights)"
    assert [str(finding) for finding in load_site(missing)[1]] == [words]
    assert [str(finding) for finding in load_profile(missing)[1]] == [words]


def test_the_builtin_mappings_all_load() -> None:
    files = sorted(builtin_mappings().glob("*.yaml"))
    assert TECO in files
    for file in files:
        profile, findings = load_profile(file)
        assert profile is not None, [str(finding) for finding in findings]


def test_patterns_of_publish_rules() -> None:
    assert means("output_*", "fan-1.output_current")
    assert not means("output_*", "fan-1.frequency_command")
    assert means("fan-?.running", "fan-1.running")
    assert not means("fan-2.*", "fan-1.running")


def test_the_gateways_own_tags_are_meant_only_by_their_underscore() -> None:
    """Safety I2: diagnostics go nowhere unless somebody asks for them by name."""
    for pattern in ("*", "*.*", "fan-1.*", "?timeouts", "?north.*", "timeouts"):
        assert not any(means(pattern, tag) for tag in ("fan-1._timeouts", "_north.timeouts"))
    assert means("_timeouts", "fan-1._timeouts")
    assert not means("_timeouts", "_north.timeouts")
    assert means("*._*", "fan-1._timeouts")
    assert means("_north.*", "_north.timeouts")


def test_no_line_is_called_as_the_gateway(tmp_path: Path) -> None:
    file = tmp_path / "site.yaml"
    file.write_text(SITE.replace("north:", "gateway:"))
    [found] = [f for f in load_site(file)[1] if "_gateway" in f.message]
    assert found.line == 4


def test_a_drive_that_keeps_running_is_told(tmp_path: Path) -> None:
    settings = "settings: {on_loss: {values: {0: coast, 3: keep_running}, default: keep_running}}\n"
    profile = small("running: {at: 0001H, bits: {on: 0}}", settings).replace(
        "rtu: [8N1]", "rtu: [8N1], comm_loss: {action: on_loss}"
    )
    (tmp_path / "small.yaml").write_text(profile)
    file = tmp_path / "site.yaml"
    text = SITE.replace("teco-7200gs", "small").replace("8N2", "8N1")
    file.write_text(text)
    assert [f.message for f in load_site(file)[1]] == ["`fan-1` keeps running when the line dies"]
    file.write_text(text.replace("unit: 5", "unit: 5, settings: {on_loss: coast}"))
    assert load_site(file)[1] == []


def test_a_framing_that_is_open_is_told_once(tmp_path: Path) -> None:
    text = SITE.replace("fan-1: {profile: teco-7200gs", "pump-1: {profile: shihlin-sl3").replace("8N2", "8N1")
    (tmp_path / "site.yaml").write_text(text)
    site, findings = load_site(tmp_path / "site.yaml")
    assert site is None
    told = [finding.message for finding in findings if finding.file.endswith("site.yaml")]
    assert told == ["`pump-1` (shihlin-sl3) may speak rtu or ascii"]


def test_framing_is_never_guessed(tmp_path: Path) -> None:
    profile = small("running: {at: 0001H, bits: {on: 0}}").replace("rtu: [8N1]", "rtu: [8N1], ascii: [7E1]")
    (tmp_path / "small.yaml").write_text(profile)
    file = tmp_path / "site.yaml"
    text = SITE.replace("teco-7200gs", "small")
    file.write_text(text.replace("8N2", "8N1"))
    assert [f.message for f in load_site(file)[1]] == ["`fan-1` (small) may speak rtu or ascii"]
    site = load(tmp_path, text.replace("    serial: 9600 8N2", "    framing: ascii\n    serial: 9600 7E1"))
    assert site.lines[0].framing == "ascii"
