"""``gateway run``: the gateway itself."""

from __future__ import annotations

import typer

from gateway.terminal.options import Ports, SiteFile

EXAMPLES = """
gateway run site.yaml

gateway run site.yaml --line north=/dev/ttyUSB0
"""


def run(site: SiteFile, line: Ports = None) -> None:
    """Run the gateway of a site until SIGTERM or Ctrl-C. Logs to standard error.

    Not a safety device: emergency stop and safe torque off stay hard-wired.
    """
    import asyncio

    from gateway.log import configure
    from gateway.supervise.keeper import StartRefusedError
    from gateway.supervisor import Supervisor, run_until_signal
    from gateway.terminal.errors import CommandError
    from gateway.terminal.sites import load, read_ports

    loaded = load(site, warn=True)
    ports = read_ports(loaded, line or ())
    configure("supervisor")

    async def serve() -> None:
        await run_until_signal(Supervisor(loaded, ports))

    try:
        asyncio.run(serve())
    except StartRefusedError as error:
        raise CommandError(str(error)) from error
    except OSError as error:
        raise CommandError(f"cannot start: {error}") from error
    raise typer.Exit(0)
