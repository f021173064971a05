"""``--what-if``: a change of a site on paper, as a person writes it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from gateway.core.planning import with_baud, with_rates
from gateway.core.polling import FASTEST
from gateway.mapping.site import Site
from gateway.terminal.errors import UsageError
from gateway.terminal.words import nearest, split

KEYS = "baud, reply and rates.<class>"
_DURATION = re.compile(r"(\d+(?:\.\d+)?)(ms|s|min)")
_SECONDS = {"ms": 0.001, "s": 1.0, "min": 60.0}


@dataclass(frozen=True, slots=True)
class Changed:
    """A site as it might be, and how long its drives are taken to need before they reply (seconds; None: as
    their profiles say)."""

    site: Site
    turnaround: float | None = None


def what_if(site: Site, words: Iterable[str]) -> Changed:
    """The site with ``baud=38400``, ``rates.fast=500ms`` or ``reply=5ms``.

    Raises:
        UsageError: if a word names nothing that can be changed, or a value cannot be read.
    """
    changed = Changed(site)
    for word in words:
        changed = _with(changed, *split(word))
    return changed


def _with(changed: Changed, key: str, text: str) -> Changed:
    site, section, name = changed.site, *_parts(key)
    if key == "baud":
        return Changed(with_baud(site, _baud(text)), changed.turnaround)
    if key == "reply":
        return Changed(site, _seconds(text))
    if section == "rates" and name in site.rates:
        return Changed(with_rates(site, {name: _period(text)}), changed.turnaround)
    if section == "rates":
        raise UsageError(f"there is no rate class {name!r}{nearest(name, site.rates)}")
    raise UsageError(f"{key!r} cannot be changed on paper; {KEYS} can")


def _parts(key: str) -> tuple[str, str]:
    section, _, name = key.partition(".")
    return section, name


def _baud(text: str) -> int:
    if not text.isdecimal() or not 300 <= int(text) <= 10_000_000:
        raise UsageError(f"{text!r} is no line speed")
    return int(text)


def _period(text: str) -> float:
    seconds = _seconds(text)
    if seconds < FASTEST:
        raise UsageError(f"nothing is read more often than every {1000 * FASTEST:g} ms")
    return seconds


def _seconds(text: str) -> float:
    found = _DURATION.fullmatch(text)
    if found is None or float(found[1]) == 0:
        raise UsageError(f"{text!r} is no duration like 500ms or 2s")
    return float(found[1]) * _SECONDS[found[2]]
