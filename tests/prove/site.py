"""The site of a scene, and what a client can find to write there."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache

from gateway.mapping.load import builtin_mappings, load_profile
from gateway.mapping.profile import Kind, Point, Profile
from gateway.mapping.site import SETPOINT, Control, DriveConfig, LineConfig, Rs485, Site
from gateway.mapping.specialise import specialise
from gateway.tag import Role
from tests.core.world import make_site
from tests.prove.scene import DriveScene, LineScene, Scene

SETTINGS: dict[str, dict[str, Fraction]] = {"s2000": {"e1_04": Fraction(60)}}
HIGHEST = Fraction(50)


@cache
def profile_of(name: str) -> tuple[Profile, dict[str, Fraction]]:
    """A shipped profile as its settings make it, and the settings."""
    profile, findings = load_profile(builtin_mappings() / f"{name}.yaml")
    assert profile is not None, findings
    known = {name: s.default for name, s in profile.settings.items() if s.default is not None}
    known |= SETTINGS.get(name, {})
    return specialise(profile, known), known


def site_of(scene: Scene) -> Site:
    """The site of a scene; lines are called a, b, ..., their drives a-1, a-2, ..."""
    lines = tuple(_line(chr(ord("a") + n), line) for n, line in enumerate(scene.lines))
    fast, normal, slow = scene.rates
    return replace(make_site(), lines=lines, rates={"fast": fast, "normal": normal, "slow": slow})


def _line(name: str, scene: LineScene) -> LineConfig:
    drives = tuple(_drive(f"{name}-{n}", name, n, drive) for n, drive in enumerate(scene.drives, 1))
    serial = drives[0].profile.serial
    return LineConfig(
        name=name,
        port="simulated:",
        framing=scene.framing,
        baud=scene.baud,
        format=(serial.rtu if scene.framing == "rtu" else serial.ascii)[0],
        rs485=Rs485(echo=scene.weather.echo == "declared"),
        drives=drives,
    )


def _drive(name: str, line: str, unit: int, scene: DriveScene) -> DriveConfig:
    profile, settings = profile_of(scene.profile)
    setpoint = Fraction(5) if scene.on_expiry == "setpoint" else None
    return DriveConfig(
        name=name,
        line=line,
        profile=profile,
        unit=unit,
        settings=settings,
        ranges={SETPOINT: (Fraction(0), HIGHEST)},
        control=Control(
            scene.lease,
            scene.ttl,
            "setpoint: 5" if setpoint is not None else scene.on_expiry,
            setpoint,
            Role.ENGINEER,
            scene.on_reappear,
        ),
    )


@cache
def switches(profile: str) -> tuple[Point, ...]:
    """Single bits that any operator may write."""
    points = profile_of(profile)[0].points.values()
    return tuple(
        p
        for p in points
        if p.kind is Kind.SWITCH and p.access.writable and not p.by_command_only and p.encoding.width == 1
    )


@cache
def watchable(profile: str) -> tuple[str, ...]:
    """Points worth watching: no parameters, and nothing that a selector shows."""
    points = profile_of(profile)[0].points.values()
    return tuple(
        p.name for p in points if p.kind is not Kind.PARAMETER and p.access.readable and not p.select
    )
