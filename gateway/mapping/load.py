"""Mapping files from the disk: profiles and site files, complete with everything that is wrong in them."""

from __future__ import annotations

from pathlib import Path

from gateway.mapping.check import check
from gateway.mapping.finding import Finding, Report, in_order
from gateway.mapping.model import RawProfile
from gateway.mapping.profile import Profile
from gateway.mapping.reader import read
from gateway.mapping.resolve import resolve
from gateway.mapping.shape import validate

SUFFIX = ".yaml"


def builtin_mappings() -> Path:
    """The folder of the profiles that come with the gateway: beside the package in a checkout, inside it
    when installed."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_mappings"
    return installed if installed.is_dir() else package.parent / "mappings"


def load_profile(path: Path) -> tuple[Profile | None, list[Finding]]:
    """A profile, or None when it has errors; and all findings in the order of the file."""
    try:
        data = path.read_bytes()
    except OSError as error:
        return None, [_unreadable(path, error)]
    return profile_of(data, str(path), path.stem)


def profile_of(data: bytes, file: str, stem: str) -> tuple[Profile | None, list[Finding]]:
    """As `load_profile`, from the file's bytes; ``file`` is its name in findings."""
    root, findings = read(data, file)
    if root is None:
        return None, findings
    report = Report(file, root)
    report.partial = bool(findings)
    raw = validate(RawProfile, report)
    profile = None
    if raw is not None:
        resolved = resolve(raw, report)
        check(resolved, stem, report)
        profile = resolved.profile
    found = in_order([*findings, *report.findings])
    return (None if any(f.severity == "error" for f in found) else profile), found


def _unreadable(path: Path, error: OSError) -> Finding:
    return Finding("error", str(path), 1, 1, f"cannot be read: {error.strerror}", "check the path and its rights")
