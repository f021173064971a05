"""What drives do when the line dies, in words and as data, as far as files tell it. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from gateway.mapping.lossdemand import described, judge, settings_of
from gateway.mapping.site import DriveConfig, LineConfig


def loss_object(drive: DriveConfig) -> dict[str, Any]:
    """For programs; the shape stands in docs/cli.md."""
    loss, demand, look = drive.profile.serial.comm_loss, drive.comm_loss, settings_of(drive)
    return {
        "drive": drive.name,
        "does": described(loss, look),
        "by": list(loss.names),
        "demand": demand.action if demand else None,
        "within": demand.within if demand else None,
        "met": judge(loss, demand, look).met if demand else None,
    }


def loss_text(drive: DriveConfig) -> str:
    """What one drive does, and whether that is what the site demands."""
    loss, demand, look = drive.profile.serial.comm_loss, drive.comm_loss, settings_of(drive)
    text = described(loss, look)
    if text is None:
        text = f"told by {', '.join(loss.names)}"
    if demand is None or demand.action == "any":
        return text
    judgement = judge(loss, demand, look)
    wanted = "stops" if demand.action == "stop" else "keeps running"
    by = f" within {demand.within:g} s" if demand.within else ""
    if judgement.met is None:
        return f"{text}; the site demands that it {wanted}{by}, and it is asked before anything is written"
    return text if judgement.met else f"{text}; nothing but a stop is written to it: {judgement.reason}"


def loss_notes(line: LineConfig) -> Iterator[str]:
    """One sentence for all drives of a line that are alike."""
    alike: dict[str, list[str]] = {}
    for drive in line.drives:
        alike.setdefault(loss_text(drive), []).append(drive.name)
    for text, names in alike.items():
        yield f"when the line dies, {', '.join(names)}: {text}"
