"""The last sample of each tag, as a table that people watch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from rich.table import Table

from gateway.bridge.api import PointInfo
from gateway.tag import Sample, Severity
from gateway.terminal.output import moment, value_text

STYLES = {Severity.GOOD: "green", Severity.UNCERTAIN: "yellow", Severity.BAD: "red"}


class Board:
    """Keeps the last sample of each tag, and knows which ones tell something new."""

    def __init__(self, points: Mapping[str, PointInfo], tags: Iterable[str]) -> None:
        self._points = points
        self._last: dict[str, Sample | None] = dict.fromkeys(tags)

    def take(self, samples: Sequence[Sample]) -> list[Sample]:
        """Keep the samples; return those whose value or quality is not what was known."""
        changed = []
        for sample in samples:
            last = self._last.get(sample.tag)
            if last is None or (last.value, last.quality) != (sample.value, sample.quality):
                changed.append(sample)
            self._last[sample.tag] = sample
        return changed

    def table(self) -> Table:
        """All tags with their last sample."""
        table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0))
        for title, justify in (("tag", "left"), ("value", "right"), ("quality", "left"), ("time", "left")):
            table.add_column(title, justify=justify, no_wrap=True)  # type: ignore[arg-type]
        for tag, sample in self._last.items():
            if sample is None:
                table.add_row(tag, "", "waiting", "")
            else:
                table.add_row(*self._cells(sample), style=STYLES[sample.quality.severity])
        return table

    def line(self) -> str:
        """All tags with their last value, on one line."""
        return "  ".join(
            f"{tag.partition('.')[2]}={value_text(sample, self._points[tag]) if sample else '?'}"
            for tag, sample in self._last.items()
        )

    def _cells(self, sample: Sample) -> tuple[str, str, str, str]:
        value = value_text(sample, self._points[sample.tag])
        return sample.tag, value, sample.quality, moment(sample.time)
