"""No two entries may claim the same bits of a register."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gateway.mapping.finding import Report
from gateway.mapping.layout import Claim, Layout
from gateway.mapping.node import Path
from gateway.mapping.profile import Point, Table, Term


def check_overlap(layout: Layout, points: Mapping[str, Point], report: Report) -> None:
    """No two entries on the same bits, unless one is only read and the other only written, or they are
    never there together. Entries with errors of their own are not judged; of two registers with many fields
    or repeats one pair is told."""
    seen: dict[tuple[Table, int], list[Claim]] = {}
    told: set[tuple[Path, Path]] = set()
    for claim in _sure(layout, report):
        other = _rival(claim, seen, points)
        if other is not None and (pair := _entries(claim.path, other.path)) not in told:
            told.add(pair)
            register, bit = divmod(max(claim.first, other.first), 16)
            report.error(
                claim.path,
                f"`{claim.name}` and `{other.name}` share bit {bit} of {register:04X}H",
                "correct the address, the bits or the width",
                key=True,
            )
        for bit in range(claim.first, claim.last + 1):
            seen.setdefault((claim.table, bit), []).append(claim)


def _sure(layout: Layout, report: Report) -> Iterator[Claim]:
    """The claims of entries without errors that matter here."""
    for claim in layout.claims:
        when = layout.keys[claim.name].where.get("when") if claim.name in layout.keys else None
        if claim.name not in layout.displaced and (when is None or not report.wrong(when)):
            yield claim


def _entries(one: Path, other: Path) -> tuple[Path, Path]:
    """The entries that two claims come from: the fields themselves if both are in one register."""
    registers = tuple(path[: path.index("bits")] if "bits" in path else path for path in (one, other))
    return (one, other) if registers[0] == registers[1] else (registers[0], registers[1])


def _rival(
    claim: Claim, seen: dict[tuple[Table, int], list[Claim]], points: Mapping[str, Point]
) -> Claim | None:
    """Another claim that cannot stand beside this one."""
    for bit in range(claim.first, claim.last + 1):
        for other in seen.get((claim.table, bit), ()):
            meet = (claim.reads and other.reads) or (claim.writes and other.writes)
            if meet and not _never_together(points.get(claim.name), points.get(other.name)):
                return other
    return None


def _never_together(one: Point | None, other: Point | None) -> bool:
    """True for points whose conditions exclude each other, or that are selected differently; and for a view
    of a word by patterns, which is only read."""
    if one is None or other is None:
        return False
    if one.select != other.select or one.encoding.patterns or other.encoding.patterns:
        return True
    pairs = ((a, b) for a in one.when for b in other.when if a.name == b.name)
    return any(not _meet(a, b) for a, b in pairs)


def _meet(one: Term, other: Term) -> bool:
    return any(a[0] <= b[1] and b[0] <= a[1] for a in one.ranges for b in other.ranges)
