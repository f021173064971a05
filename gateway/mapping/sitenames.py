"""From the sections ``names`` of a site file to the names of all its drives. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from gateway.mapping import naming
from gateway.mapping.finding import Report
from gateway.mapping.forms import FormError
from gateway.mapping.namecheck import Named, check_names
from gateway.mapping.node import Path
from gateway.mapping.profile import Profile
from gateway.mapping.shape import nearest
from gateway.mapping.site import DriveConfig, Site
from gateway.mapping.sitefile import Drive, DriveNames, RawSite, Templates

_SECTION = "names"


def with_names(raw: RawSite, site: Site, profiles: Mapping[str, Profile], report: Report) -> Site:
    """The site with the names of its drives, points and commands, all of them checked.

    ``profiles`` are whole: a name may be given to a point that the settings of a drive leave out.
    """
    namer = _Namer(raw, profiles, report)
    lines = tuple(replace(line, drives=tuple(map(namer.named, line.drives))) for line in site.lines)
    check_names(namer.drives.values(), site.site, raw.lines, report)
    return replace(site, lines=lines)


class _Namer:
    """Names one drive after the other, and remembers what each name comes from."""

    def __init__(self, raw: RawSite, profiles: Mapping[str, Profile], report: Report) -> None:
        self._raw = raw
        self._profiles = profiles
        self._report = report
        self._common = self._templates(raw.names, (_SECTION,))
        self.drives: dict[str, Named] = {}

    def named(self, drive: DriveConfig) -> DriveConfig:
        """The drive with its names."""
        place: Path = ("lines", drive.line, "drives", drive.name)
        raw = self._raw.lines[drive.line].drives[drive.name]
        own = raw.names or DriveNames()
        texts = {**self._common, **self._templates(own, (*place, _SECTION))}
        owner = naming.Owner(self._raw.site, self._raw.gateway, drive.line, drive.name)
        single = self._single(raw, own, (*place, _SECTION, "points"))
        names = naming.names_of(owner, drive.profile, {**naming.DEFAULTS, **texts}, single)
        where = {("", key): place for key in naming.DEFAULTS}
        where |= {("", key): (_SECTION, key) for key in self._common}
        where |= {("", key): (*place, _SECTION, key) for key in own.given()}
        where |= {
            (name, key): (*place, _SECTION, "points", name, key)
            for name, keys in single.items()
            for key in keys
        }
        self.drives.setdefault(drive.name, Named(drive.name, names, drive.profile, where))
        return replace(drive, names=names)

    def _templates(self, raw: Templates, path: Path) -> dict[str, str]:
        """The templates of a section; those that mean nothing are complained about and left out."""
        good = {}
        for key, text in raw.given().items():
            try:
                naming.check_template(key, text)
                good[key] = text
            except FormError as error:
                self._report.error((*path, key), error.message, error.remedy)
        return good

    def _single(self, raw: Drive, own: DriveNames, path: Path) -> Mapping[str, Mapping[str, str]]:
        """The names given to single points and commands."""
        profile = self._profiles[raw.profile]
        known = [*profile.points, *profile.commands]
        for name in own.points:
            if name not in known:
                message = f"`{profile.name}` has no point or command `{name}`"
                self._report.unknown_name((*path, name), name, message, nearest(name, known), key=True)
        return {name: names.given() for name, names in own.points.items()}
