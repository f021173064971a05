"""What is wrong with a line, in words: one sentence, and what to do about it. Pure.

`gateway.line.doctor` finds it out; here are the names of drives, and what the site file says of the line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from gateway.bridge.api import Diagnosis
from gateway.line.doctor.finding import Finding, Illness
from gateway.mapping.site import LineConfig
from gateway.tag import own_name

Severity = Literal["error", "warning", "info"]

SEVERITY: Mapping[Illness, Severity] = MappingProxyType(
    {
        Illness.PORT_DOWN: "error",
        Illness.WRONG_FORMAT: "error",
        Illness.ALL_SILENT: "error",
        Illness.ECHO_MISSING: "error",
        Illness.FOREIGN_MASTER: "error",
        Illness.TWO_DRIVES: "error",
        Illness.LATE_ANSWERS: "warning",
        Illness.DRIVE_SILENT: "warning",
        Illness.NOISE: "warning",
        Illness.LATENCY_TIMER: "warning",
        Illness.ECHO_UNDECLARED: "info",
    }
)


@dataclass(frozen=True, slots=True)
class Place:
    """A line, and why its port is not open, if so."""

    config: LineConfig
    reason: str = ""

    def name(self, unit: int) -> str:
        """A drive by name and address; the address alone of one that the site does not have."""
        known = next((drive.name for drive in self.config.drives if drive.unit == unit), None)
        return f"unit {unit}" if known is None else f"{known} (unit {unit})"

    def profile(self, unit: int) -> str:
        """The name of a drive's profile, in brackets; empty of one that the site does not have."""
        known = next((drive.profile.name for drive in self.config.drives if drive.unit == unit), None)
        return "" if known is None else f" ({known})"

    def names(self, units: Sequence[int], most: int = 4) -> str:
        """Several drives; with many, the first ones and the number of the others."""
        named = [self.name(unit) for unit in units[:most]]
        more = [f"{len(units) - most} more"] if len(units) > most else []
        return " and ".join(filter(None, (", ".join([*named, *more][:-1]), [*named, *more][-1])))

    @property
    def speed(self) -> str:
        """How the line speaks, as the site file writes it."""
        config = self.config
        return (
            config.framing if config.framing == "tcp" else f"{config.framing} {config.baud} {config.format}"
        )


def diagnosis(finding: Finding, place: Place, since: int) -> Diagnosis:
    """A finding as everybody is told of it; ``since`` is when it was made (nanoseconds since 1970)."""
    text, remedy = _WORDS[finding.illness](finding, place)
    drives = {drive.unit: drive.name for drive in place.config.drives}
    return Diagnosis(
        line=place.config.name,
        code=finding.illness.value,
        severity=SEVERITY[finding.illness],
        text=text,
        remedy=remedy,
        drives=tuple(drives[unit] for unit in finding.units if unit in drives),
        evidence=dict(finding.evidence),
        since=since,
    )


def subject(line: str) -> str:
    """What alarms about a line are filed under."""
    return own_name(line)


Words = Callable[[Finding, Place], tuple[str, str]]
"""The sentence, and the remedy."""


def _n(finding: Finding, name: str) -> int:
    return round(finding.evidence[name])


def _count(number: int, one: str, many: str = "") -> str:
    """``1 drive``, ``2 drives``, ``2 replies``."""
    return f"{number} {one}" if number == 1 else f"{number} {many or f'{one}s'}"


def _port_down(finding: Finding, place: Place) -> tuple[str, str]:
    return (
        f"the port {place.config.port} is not open: {place.reason.removeprefix(f'{place.config.port}: ')}",
        "look whether the adapter is plugged in, the path is right, and nothing else uses it",
    )


def _wrong_format(finding: Finding, place: Place) -> tuple[str, str]:
    drives = _count(_n(finding, "drives"), "drive")
    return (
        f"{drives} answered garbage and nothing else for {_n(finding, 'seconds')} s: speed or format differ",
        f"compare what the drives are set to with {place.speed}; `gateway scan {place.config.port}` finds it",
    )


def _all_silent(finding: Finding, place: Place) -> tuple[str, str]:
    drives = _count(_n(finding, "drives"), "drive")
    seconds = _n(finding, "seconds")
    if finding.evidence["answered_before"]:
        return (
            f"nothing comes back any more from {drives} that answered until {seconds} s ago",
            "check the cable, the adapter and the supply of the drives",
        )
    return (
        f"nothing came back from {drives} in {seconds} s",
        f"check the supply, both wires and their polarity, the port, the unit addresses, and {place.speed}; "
        f"`gateway scan {place.config.port}` tries others",
    )


def _echo_missing(finding: Finding, place: Place) -> tuple[str, str]:
    return (
        "replies come without the echo that the site file declares, so that none is believed",
        f"take `echo: true` out of `rs485` of line {place.config.name}",
    )


def _echo_undeclared(finding: Finding, place: Place) -> tuple[str, str]:
    return (
        "the transceiver hands back what is sent, and the site file does not say so",
        f"add `rs485: {{echo: true}}` to line {place.config.name}, or switch the echo off",
    )


def _foreign_master(finding: Finding, place: Place) -> tuple[str, str]:
    return (
        f"somebody else asks on this line: {_count(_n(finding, 'requests'), 'request')} and "
        f"{_count(_n(finding, 'replies'), 'reply', 'replies')} that are not ours, "
        f"of {place.names(finding.units)}",
        "disconnect the other master; a serial line has one",
    )


def _two_drives(finding: Finding, place: Place) -> tuple[str, str]:
    [unit] = finding.units
    name = place.name(unit)
    remedy = f"switch {name} off: if something still answers at unit {unit}, give that another address"
    if "second_replies" in finding.evidence:
        contrary = _n(finding, "contradicting")
        saying = f", {contrary} of them saying something else" if contrary else ""
        return f"{name} answers twice: {_n(finding, 'second_replies')} second replies{saying}", remedy
    garbled, good = _n(finding, "garbled"), _n(finding, "replies")
    return (
        f"most replies of {name} are garbled ({garbled}, beside {good} good ones), those of other drives are "
        f"not: two drives with this address talk at once, or its connection is bad",
        f"{remedy}; else check its connection",
    )


def _late_answers(finding: Finding, place: Place) -> tuple[str, str]:
    [unit] = finding.units
    milliseconds, longest = _n(finding, "milliseconds"), _n(finding, "longest")
    then = "it is waited for longer" if finding.evidence["replies"] else "they are not waited for so long"
    return (
        f"answers of {place.name(unit)} come after {milliseconds} ms, and its profile says {longest} ms at "
        f"most: {then}",
        f"raise the end of `reply` in its profile{place.profile(unit)} to {_next_round(milliseconds)}ms; "
        "look at what lies between (a radio, a device server)",
    )


def _next_round(milliseconds: int) -> int:
    """Half as much again, as people write it."""
    return 50 * math.ceil(1.5 * milliseconds / 50)


def _drive_silent(finding: Finding, place: Place) -> tuple[str, str]:
    answering, unanswered = _n(finding, "answering"), _count(_n(finding, "unanswered"), "request")
    others = f"{_count(answering, 'other')} {'does' if answering == 1 else 'do'}"
    who = place.names(finding.units)
    if len(finding.units) == 1:
        remedy = "check its supply, its unit address, and its branch of the cable"
        return f"{who} does not answer ({unanswered}); {others}", remedy
    remedy = "check their supply, their unit addresses, and the cable behind the last drive that answers"
    return f"{who} do not answer ({unanswered}); {others}", remedy


def _noise(finding: Finding, place: Place) -> tuple[str, str]:
    damaged = _count(_n(finding, "damaged"), "damaged reply", "damaged replies")
    good, strays = _n(finding, "replies"), _n(finding, "strays")
    if finding.units:
        name = place.names(finding.units)
        text = f"{damaged} of {name} and of nobody else, beside {good} good ones"
        return text, f"check how {name} is connected"
    beside = f" and {_count(strays, 'burst')} of bytes that nobody sent" if strays else ""
    return (
        f"noise: {damaged}{beside}, beside {good} good ones",
        "check the termination at both ends, the shield and the earthing, and what runs beside the cable",
    )


def _latency_timer(finding: Finding, place: Place) -> tuple[str, str]:
    device = place.config.port.rpartition("/")[2]
    return (
        "replies arrive on a grid of 16 ms: the adapter's latency timer holds them back",
        f"set it to 1 ms: echo 1 > /sys/bus/usb-serial/devices/{device}/latency_timer",
    )


_WORDS: Mapping[Illness, Words] = MappingProxyType(
    {
        Illness.PORT_DOWN: _port_down,
        Illness.WRONG_FORMAT: _wrong_format,
        Illness.ALL_SILENT: _all_silent,
        Illness.ECHO_MISSING: _echo_missing,
        Illness.FOREIGN_MASTER: _foreign_master,
        Illness.TWO_DRIVES: _two_drives,
        Illness.LATE_ANSWERS: _late_answers,
        Illness.DRIVE_SILENT: _drive_silent,
        Illness.NOISE: _noise,
        Illness.LATENCY_TIMER: _latency_timer,
        Illness.ECHO_UNDECLARED: _echo_undeclared,
    }
)
