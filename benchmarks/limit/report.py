"""The figures as a table for people."""

from __future__ import annotations

from typing import Any

Row = dict[str, Any]


def heading() -> str:
    """What the columns hold."""
    return f"{'scenario':36} {'figure':>8} {'to reach':>20} {'':4} details"


def line(row: Row) -> str:
    """One run."""
    mark = "ok" if row["reached"] else "NO"
    wanted = row["wanted"] if isinstance(row["wanted"], str) else f"{row['wanted']:.0%}"
    return f"{row['scenario']:36} {_figure(row):>8} {wanted:>20} {mark:4} {_details(row)}"


def _figure(row: Row) -> str:
    if "ratio" in row:
        return f"{row['ratio']:.2%}"
    return f"{row['stop']:.1f} ms" if "stop" in row else ""


def _details(row: Row) -> str:
    if "transactions" in row:
        return (
            f"{row['transactions']:.1f} of {row['ideal_transactions']:.1f} transactions/s, "
            f"{row['registers']:.0f} of {row['ideal_registers']:.0f} registers/s, "
            f"{row['violations']} violations in {row['requests']}; unanswered {row['unanswered']}; "
            f"idle {_spread(row['idle'])}; emulator late {_spread(row['late'])}; "
            f"evenness {row['evenness']}; {row['notifications']:.0f} notifications/s, "
            f"{row['messages']:.0f} messages/s; cpu {_cpu(row['cpu'])}"
        )
    rest = {key: value for key, value in row.items() if key not in ("scenario", "wanted", "reached", "ratio")}
    return ", ".join(f"{key} {value}" for key, value in rest.items())


def _spread(values: dict[str, float]) -> str:
    if not values:
        return "unknown"
    return (
        f"{values['mean']:.2f} (p50 {values['p50']:.2f}, p99 {values['p99']:.2f}, max {values['max']:.1f}) ms"
    )


def _cpu(used: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.0f} %" for name, value in used.items())
