"""Site files for commands: loaded, or refused with everything that is wrong in them."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from gateway.mapping.absent import why_absent
from gateway.mapping.finding import Finding
from gateway.mapping.load import load_site
from gateway.mapping.site import Site
from gateway.terminal.errors import CommandError, UsageError
from gateway.terminal.words import nearest, split


class WrongSiteError(CommandError):
    """The site file has errors; the message is one finding a line."""

    prefix = ""


def load(path: Path, *, warn: bool = False) -> Site:
    """The site of a file. With ``warn`` its warnings go to standard error: where a gateway starts or a line
    is planned, and not again with each question to it.

    Raises:
        WrongSiteError: if the file or a profile that it uses has errors.
    """
    site, findings = load_site(path)
    if site is None:
        raise WrongSiteError(listed(findings))
    if findings and warn:
        sys.stderr.write(listed(findings) + "\n")
    return site


def refuse_absent(site: Site, drive: str, name: str) -> None:
    """Say why a drive has not what its profile knows; nothing for any other name.

    Raises:
        CommandError: with the reason.
    """
    config = next((config for config in site.drives if config.name == drive), None)
    reason = "" if config is None else why_absent(config, name)
    if reason:
        raise CommandError(f"{drive}.{name} cannot be used: {reason}")


def listed(findings: Iterable[Finding]) -> str:
    """One finding a line: ``file:line:column: message (remedy)``."""
    return "\n".join(str(finding) for finding in findings)


def read_ports(site: Site, words: Iterable[str]) -> dict[str, str]:
    """``NAME=PORT`` words as ports by line name.

    Raises:
        UsageError: if a line is unknown.
    """
    ports = dict(split(word) for word in words)
    chosen_lines(site, ports)
    return ports


def chosen_lines(site: Site, words: Iterable[str]) -> list[str]:
    """The named lines, all lines if none is named.

    Raises:
        UsageError: if a line is unknown.
    """
    names = [line.name for line in site.lines]
    chosen = list(words)
    for name in chosen:
        if name not in names:
            raise UsageError(f"there is no line {name!r}{nearest(name, names)}")
    return chosen or names
