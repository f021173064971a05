"""A drive's life on the wire: the real core against the simulated twin, written down as text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gateway.core.events import Event, Received, Transmit
from gateway.mapping.load import load_site
from gateway.simulator.happening import Happening, Trip
from gateway.tag import Outcome, Value, Verdict
from tests.core.world import World

SITE = """\
site: plant7
gateway: gw1
lines:
  north:
    port: "simulated:"
    framing: {framing}
    serial: {serial}
    drives:
      fan-1:
        profile: {profile}
        unit: {unit}
        control: {{lease: off}}
        settings: {settings}
rates: {{fast: 200ms, normal: 60s, slow: 600s}}
writes: {{enabled: true}}
"""


class Life(World):
    """One drive named fan-1 that nobody watches, with quick ramps. Whatever goes over the wire is kept
    with its headings: ``>>`` what the gateway sent, ``<<`` what the drive answered."""

    def __init__(
        self,
        folder: Path,
        profile: str,
        *,
        unit: int,
        serial: str,
        framing: str = "rtu",
        settings: str = "{}",
    ) -> None:
        self.written: list[str] = []
        path = folder / "site.yaml"
        path.write_text(
            SITE.format(profile=profile, unit=unit, serial=serial, framing=framing, settings=settings)
        )
        site, findings = load_site(path)
        assert site is not None, [str(finding) for finding in findings]
        super().__init__(site, acceleration=0.2, deceleration=0.2, fast_deceleration=0.1)

    def found(self) -> Life:
        """Wait for the drive's first answer."""
        self.until(lambda: self.states() or None, 5.0)
        return self

    def chapter(self, title: str) -> None:
        """Begin another part of the transcript."""
        self.run(0.3)
        self.written.append(f"# {title}")

    def do(self, name: str, *, verdict: Verdict = Verdict.CONFIRMED, **args: Value) -> Outcome:
        """Carry out a command."""
        outcome = self.command(name, **args)
        assert outcome.verdict is verdict, outcome
        return outcome

    def put(self, point: str, value: Value, *, verdict: Verdict = Verdict.CONFIRMED) -> Outcome:
        """Write a point."""
        outcome = self.write(f"fan-1.{point}", value)
        assert outcome.verdict is verdict, outcome
        return outcome

    def value(self, point: str) -> Value:
        """Read a point."""
        (sample,) = self.read(f"fan-1.{point}")
        return sample.value

    def happens(self, happening: Happening) -> None:
        """Let something happen to the drive."""
        self.drives["fan-1"].post(happening)

    def trips(self, fault: str) -> None:
        """Let a fault strike."""
        self.happens(Trip(fault))

    def text(self) -> str:
        """The whole transcript."""
        return "\n".join(self.written) + "\n"

    def feed(self, event: Event) -> None:
        if isinstance(event, Received):
            self._note("<<", event.data)
        super().feed(event)

    def _carry_out(self, action: Any) -> None:
        if isinstance(action, Transmit):
            self._note(">>", action.data)
        super()._carry_out(action)

    def _note(self, arrow: str, data: bytes) -> None:
        """What comes in pieces is one line."""
        text = data.hex(" ").upper()
        if self.written and arrow == "<<" and self.written[-1].startswith(arrow):
            self.written[-1] += f" {text}"
        else:
            self.written.append(f"{arrow} {text}")
