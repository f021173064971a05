"""Drive models for commands: by name, by file, or all that come with the gateway."""

from __future__ import annotations

from pathlib import Path

from gateway.mapping.load import builtin_mappings, load_profile
from gateway.mapping.profile import Profile
from gateway.terminal.errors import UsageError
from gateway.terminal.sites import WrongSiteError, listed
from gateway.terminal.words import nearest


def profile_named(name: str) -> Profile:
    """The profile of that name, or in that file.

    Raises:
        UsageError: if there is none.
        WrongSiteError: if it has errors.
    """
    path = Path(name) if name.endswith((".yaml", ".yml")) else builtin_mappings() / f"{name}.yaml"
    if not path.is_file():
        known = [file.stem for file in builtin_mappings().glob("*.yaml")]
        raise UsageError(f"there is no profile {name!r}{nearest(name, known)}")
    profile, findings = load_profile(path)
    if profile is None:
        raise WrongSiteError(listed(findings))
    return profile


def builtin_profiles() -> list[Profile]:
    """All profiles that come with the gateway and have no errors."""
    loaded = (load_profile(path)[0] for path in sorted(builtin_mappings().glob("*.yaml")))
    return [profile for profile in loaded if profile is not None]
