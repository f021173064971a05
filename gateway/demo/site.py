"""The demo's site: written into a folder, and told about."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gateway.mapping.site import Site
from gateway.supervise.broker import USUAL_PORT, free_port
from gateway.supervisor import Supervisor
from gateway.tag import Role
from gateway.terminal.sites import load
from gateway.users import add_user

USER = "operator"
ENDPOINT = "opc.tcp://127.0.0.1:4840"
DRIVE = "fan-1"
POINTS = ("running", "output_frequency", "output_current", "output_voltage", "dc_bus_voltage", "output_power")


@dataclass(frozen=True, slots=True)
class Demo:
    """A demo that is ready to be run."""

    site: Site
    password: str
    """Of the user `USER`, in clear: it lives as long as the demo."""

    @property
    def endpoint(self) -> str:
        """Where OPC UA clients connect."""
        return str((self.site.opcua or {})["endpoint"])


def prepare(folder: Path) -> Demo:
    """Write the demo's site and its one user into ``folder``. A port that is taken is replaced.

    Raises:
        OSError: if the folder cannot be written.
    """
    path = folder / "site.yaml"
    text = example().read_text(encoding="utf-8")
    endpoint = ENDPOINT.replace("4840", str(free_port(4840)))
    path.write_text(text.replace(ENDPOINT, endpoint), encoding="utf-8")
    site = load(path)
    password = secrets.token_urlsafe(9)
    add_user(Path((site.opcua or {})["users_file"]), USER, Role.OPERATOR, password)
    return Demo(site, password)


def example() -> Path:
    """The demo's site file: inside the package when installed, beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "_examples" / "demo.yaml"
    return installed if installed.is_file() else package.parent / "examples" / "demo.yaml"


def banner(demo: Demo, supervisor: Supervisor, log: Path, program: str) -> Iterator[str]:
    """What to know and what to try, line by line. ``program`` is how this gateway is called."""
    site, path = demo.site, demo.site.path
    port = supervisor.broker.port if supervisor.broker else USUAL_PORT
    yield f"A simulated 7200GS, {DRIVE}, on a line at 9600 8N2. Not a safety device."
    yield ""
    yield f"  OPC UA   {demo.endpoint}  (anonymous reads; to command: user {USER}, password {demo.password})"
    yield f"  MQTT     mqtt://127.0.0.1:{port}  (topics below {site.site}/)"
    yield f"  site     {path}"
    yield f"  log      {log}"
    yield from _moved(demo.endpoint, ENDPOINT)
    yield from _moved(f"mqtt://127.0.0.1:{port}", f"mqtt://127.0.0.1:{USUAL_PORT}")
    yield ""
    yield "Try in another terminal:"
    yield f"  {program} command {path} {DRIVE} run_forward frequency=60"
    yield f"  {program} watch {path} '{DRIVE}.output_*'"
    yield f"  mosquitto_sub -p {port} -v -t '{site.site}/{DRIVE}/state/output_frequency'"
    yield ""
    yield "Ctrl-C ends the demo."


def _moved(address: str, usual: str) -> Iterator[str]:
    if address != usual:
        yield f"  ({usual} was taken, so it is {address})"
