"""Mapping files from the disk: profiles and site files, complete with everything that is wrong in them."""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from pathlib import Path

from gateway.mapping.examine import read_profile
from gateway.mapping.finding import Finding, Report, has_errors, in_order
from gateway.mapping.library import SUFFIX as SUFFIX  # noqa: PLC0414
from gateway.mapping.library import Library, is_profile, unreadable
from gateway.mapping.node import Path as Place
from gateway.mapping.profile import Profile
from gateway.mapping.reader import read
from gateway.mapping.shape import nearest
from gateway.mapping.site import Site
from gateway.mapping.sitecheck import check_site
from gateway.mapping.sitefile import RawSite
from gateway.mapping.sitenames import with_names
from gateway.mapping.sites import resolve_site
from gateway.mapping.validation import validate


def builtin_mappings() -> Path:
    """The folder of the profiles that come with the gateway: beside the package in a checkout, inside it
    when installed."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_mappings"
    return installed if installed.is_dir() else package.parent / "mappings"


def load_profile(path: Path) -> tuple[Profile | None, list[Finding]]:
    """A profile, or None when it has errors; and all findings in the order of the file.

    A profile that it is ``like`` is sought beside it and among the built-in ones.
    """
    library = Library([path.parent, builtin_mappings()])
    try:
        file = library.take(path)
    except OSError as error:
        return None, [unreadable(path, error)]
    return profile_of(file.data, file.name, path.stem, library)


def profile_of(
    data: bytes, file: str, stem: str, library: Library | None = None
) -> tuple[Profile | None, list[Finding]]:
    """As `load_profile`, from the file's bytes; ``file`` is its name in findings, ``library`` has the
    profiles that it may be ``like``."""
    read = read_profile(data, file, stem, library or Library([builtin_mappings()]))
    return (None if has_errors(read.findings) else read.profile), read.findings


def load_site(path: Path, extra: Sequence[Path] = ()) -> tuple[Site | None, list[Finding]]:
    """A site with the profiles that it names, or None when anything has errors; and all findings.

    Profiles are sought in the folders that the site file lists, in ``extra``, beside the site file, and
    among the built-in ones; the first one counts. Findings of profiles follow those of the site file.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        return None, [unreadable(path, error)]
    root, findings = read(data, str(path))
    if root is None:
        return None, findings
    if isinstance(root.value, dict) and "site" not in root.value and is_profile(data):
        told = f"gateway profiles ./{path.name} reads it"
        return None, [Finding("error", str(path), 1, 1, "this is a profile, and no site file", told)]
    report = Report(str(path), root)
    raw = validate(RawSite, report)
    if raw is None:
        return None, in_order([*findings, *report.findings])
    library = Library(_folders(raw, path, extra), data)
    shelf = _Shelf(library)
    profiles = shelf.of(raw, report)
    site = resolve_site(raw, path.absolute(), profiles, library.digest.hexdigest(), report)
    site = with_names(raw, site, profiles, report)
    check_site(raw, site, report)
    _check_files(raw, site, report)
    found = [*in_order([*findings, *report.findings]), *shelf.findings]
    return (None if has_errors(found) else site), found


def _folders(raw: RawSite, path: Path, extra: Sequence[Path]) -> list[Path]:
    listed = [path.parent / folder for folder in raw.profiles]
    return [*listed, *extra, path.parent, builtin_mappings()]


class _Shelf:
    """The profiles of one site: each is read once, and counts in the site's digest."""

    def __init__(self, library: Library) -> None:
        self._library = library
        self.findings: list[Finding] = []

    def of(self, raw: RawSite, report: Report) -> dict[str, Profile]:
        """The profiles that a site names, by name; a drive whose profile is not there is an error. One with
        errors is there as far as it can be understood, so that the site can be judged all the same."""
        loaded: dict[str, Profile | None] = {}
        for line, entry in raw.lines.items():
            for drive, config in entry.drives.items():
                place = ("lines", line, "drives", drive, "profile")
                if config.profile not in loaded and not report.lost.covers(place):
                    loaded[config.profile] = self._load(config.profile, place, report)
        return {name: profile for name, profile in loaded.items() if profile is not None}

    def _load(self, name: str, place: Place, report: Report) -> Profile | None:
        path = self._library.find(name)
        if path is None:
            report.error(place, f"there is no profile `{name}`", nearest(name, self._library.names()))
            return None
        try:
            file = self._library.take(path)
        except OSError as error:
            self.findings.append(unreadable(path, error))
            return None
        if not is_profile(file.data):
            message = f"`{path.name}` is there, but it is no profile"
            report.error(place, message, nearest(name, self._library.names()))
            return None
        found = read_profile(file.data, file.name, path.stem, self._library)
        self.findings += found.findings
        if found.lost is not None:
            report.lost.absorb(found.lost)
        return found.profile


def _check_files(raw: RawSite, site: Site, report: Report) -> None:
    """Files that hold secrets must be there, and must not be open to everybody."""
    for index, section in enumerate(site.mqtt):
        for key in ("password_file", "ca_file"):
            if section[key] is None:
                continue
            place = ("mqtt", index, key)
            file = Path(section[key])
            if not file.is_file():
                report.warn(
                    place,
                    f"there is no file `{getattr(raw.mqtt[index], key)}`",
                    "put it there before the start",
                )
            elif key == "password_file" and _open_to_all(file):
                report.error(place, "everybody on this machine may read this file", "chmod 640 or stricter")


def _open_to_all(file: Path) -> bool:
    """True when everybody may read the file; Windows has no such mode to look at."""
    return os.name == "posix" and bool(stat.S_IMODE(file.stat().st_mode) & stat.S_IROTH)
