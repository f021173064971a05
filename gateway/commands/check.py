"""``gateway check``: what is wrong in a site file, without touching any line."""

from __future__ import annotations

import typer

from gateway.terminal.options import AsJson, SiteFile

EXAMPLES = """
gateway check site.yaml
"""


def check(site: SiteFile, as_json: AsJson = False) -> None:
    """Check a site file and the profiles it uses; print every finding. Exit 1 if one is an error."""
    from gateway.mapping.finding import has_errors
    from gateway.mapping.load import load_site
    from gateway.terminal.output import say, say_json

    loaded, findings = load_site(site)
    for finding in findings:
        if as_json:
            say_json(finding)
        else:
            say(str(finding))
    if loaded is None or has_errors(findings):
        raise typer.Exit(1)
    if not as_json:
        drives = len(loaded.drives)
        say(f"{site}: site {loaded.site}, lines: {len(loaded.lines)}, drives: {drives}, no errors")
