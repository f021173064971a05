"""The settings of a profile: facts that only the panel or the plant knows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gateway.mapping.encodings import Encodings, Names
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.inherit import Level, Sources
from gateway.mapping.model import Setting as RawSetting
from gateway.mapping.node import Path
from gateway.mapping.profile import Setting
from gateway.mapping.values import in_words, single_value


class SettingMaker:
    """Makes the settings of one profile."""

    def __init__(self, encodings: Encodings, sources: Sources, report: Report) -> None:
        self._encodings = encodings
        self._sources = sources
        self._report = report

    def make(self, name: str, raw: RawSetting, levels: list[Level]) -> Setting | None:
        """One setting; its default is checked like a value that a site gives. None when it has errors."""
        path = levels[-1][0]
        setting = None if self._report.doubtful(path) else self._made(name, raw, levels)
        if self._report.doubtful(path) or not self._encodings.knows(raw.values):
            self._report.lost.declare(name)
            return None
        return setting

    def _made(self, name: str, raw: RawSetting, levels: list[Level]) -> Setting:
        path = levels[-1][0]
        low, high = self._range(raw, path)
        names = self._names(raw, (*path, "values"))
        setting = Setting(
            name=name,
            low=low,
            high=high,
            symbol=self._symbol(raw, path),
            values=names.values,
            help=raw.help or "",
            provenance=self._sources.of(levels),
            names=self._sources.names(names.entries, levels),
        )
        return self._with_default(setting, raw, path)

    def _range(self, raw: RawSetting, path: Path) -> tuple[Any, Any]:
        if raw.range is None:
            return None, None
        if isinstance(raw.range.low, str) or isinstance(raw.range.high, str):
            self._report.error(
                (*path, "range"), "the range of a setting has numbers only", "write it like 0..50"
            )
            return None, None
        return raw.range.low, raw.range.high

    def _names(self, raw: RawSetting, path: Path) -> Names:
        names = self._encodings.values(raw.values, path)
        if names.patterns:
            remedy = "name each raw value by itself"
            self._report.error(path, "a setting has no bits that a pattern could pick", remedy)
        return names

    def _symbol(self, raw: RawSetting, path: Path) -> str | None:
        if raw.unit is None:
            return None
        if raw.unit.scale != 1:
            self._report.error(
                (*path, "unit"),
                f"a setting counts in ones, not in {in_words(raw.unit.scale)}",
                f"write 1 {raw.unit.symbol}",
            )
        return raw.unit.symbol

    def _with_default(self, setting: Setting, raw: RawSetting, path: Path) -> Setting:
        if raw.default is None:
            return setting
        try:
            return replace(setting, default=single_value(raw.default, setting))
        except FormError as error:
            self._report.error((*path, "default"), error.message, error.remedy)
            return setting
