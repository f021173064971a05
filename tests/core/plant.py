"""A site on disk with simulated drives on a pty, for tests of whole processes."""

from __future__ import annotations

from pathlib import Path

from gateway.mapping.load import load_site
from gateway.mapping.site import Site
from gateway.simulator.live import SimulatedLine

SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: lines/north
    serial: {serial}
    drives:
      fan-1: {{profile: teco-7200gs, unit: 5, control: {{lease: off}}}}
writes: {{enabled: {writes}}}
data: data
"""


def write_site(folder: Path, *, writes: bool = True, serial: str = "9600 8N2", more: str = "") -> Path:
    """Write a site file whose one line is the pty ``lines/north`` in the same folder."""
    path = folder / "site.yaml"
    path.write_text(SITE.format(writes=str(writes).lower(), serial=serial) + more)
    (folder / "lines").mkdir(exist_ok=True)
    return path


def load(path: Path) -> Site:
    """The site, which must be without errors."""
    site, findings = load_site(path)
    assert site is not None, [str(finding) for finding in findings]
    return site


def simulated(site: Site) -> SimulatedLine:
    """The site's line with its drives."""
    return SimulatedLine(site.lines[0], site.path.parent / "lines")
