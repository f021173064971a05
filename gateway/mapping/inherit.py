"""Inheritance inside a profile: a key on a group or register holds for what is below; the nearest wins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from gateway.mapping.finding import Report
from gateway.mapping.lost import HARMLESS
from gateway.mapping.model import NamedValue, Sourced, Traits
from gateway.mapping.node import Path
from gateway.mapping.profile import OURS, Document, NameFact, Provenance
from gateway.mapping.shape import nearest

Level = tuple[Path, Sourced]
"""One of the tables that a datum stands in, and where it is; lists of them go from the outside in."""


@dataclass(frozen=True, slots=True)
class Inherited:
    """The keys that hold for a datum, and where each of them is written."""

    traits: Traits
    path: Path
    where: Mapping[str, Path]

    def place(self, key: str) -> Path:
        """Where a key is written; the datum's own place when it is not."""
        return self.where.get(key, self.path)

    def wrong(self, report: Report) -> set[str]:
        """The keys that have errors where they are written, but for those that change nothing."""
        return {key for key, path in self.where.items() if report.wrong(path)} - set(HARMLESS)


def inherit(levels: Sequence[Level]) -> Inherited:
    """The keys of all levels laid over each other."""
    values: dict[str, object] = {}
    where: dict[str, Path] = {}
    for path, level in levels:
        for key in Traits.model_fields.keys() & level.model_fields_set:
            values[key] = getattr(level, key)
            where[key] = (*path, key)
    return Inherited(Traits.model_construct(**values), levels[-1][0], where)  # type: ignore[arg-type]


def overlay(keys: Inherited, path: Path, case: Sourced) -> Inherited:
    """The keys with those of a case laid over them; the case's own ``when`` and provenance are no keys."""
    values = {name: getattr(keys.traits, name, None) for name in keys.where}
    where = dict(keys.where)
    for key in (Traits.model_fields.keys() & case.model_fields_set) - {"when", "source", "doubt"}:
        values[key] = getattr(case, key)
        where[key] = (*path, key)
    return Inherited(Traits.model_construct(**values), keys.path, where)


class Sources:
    """The documents of a profile, and which of them a datum comes from."""

    def __init__(self, documents: Mapping[str, Document], report: Report) -> None:
        self._documents = documents
        self._report = report

    def of(self, levels: Sequence[Level]) -> Provenance:
        """Provenance of the innermost level; without any ``source`` it is the first document."""
        where: Path = ()
        source, doubt = "", None
        for path, level in levels:
            if level.source is not None:
                source, where = level.source, path
                self._check(source, path)
            doubt = level.doubt if level.doubt is not None else doubt
        document, _, place = source.partition(" ")
        if document == OURS and doubt is None and not self._report.lost.hurts(where):
            message = "what stands in no document needs a `doubt`"
            self._report.error((*where, "source"), message, "say why it is assumed")
        document = document or next(iter(self._documents), "")
        known = self._documents.get(document)
        return Provenance(document, place.strip(), known is not None and known.similar, doubt)

    def names(self, entries: Mapping[int, Level], levels: Sequence[Level]) -> Mapping[int, NameFact]:
        """What is known of each named raw value of a datum that stands at these levels."""
        found = {}
        for raw, (path, entry) in entries.items():
            assert isinstance(entry, NamedValue)
            origin = self.of([*levels, (path, entry)])
            found[raw] = NameFact(entry.name, entry.help or "", origin)
        return MappingProxyType(found)

    def _check(self, source: str, path: Path) -> None:
        document = source.partition(" ")[0]
        if document not in self._documents and document != OURS:
            self._report.unknown_name(
                (*path, "source"),
                document,
                f"`{document}` is none of the documents",
                nearest(document, list(self._documents)),
            )
