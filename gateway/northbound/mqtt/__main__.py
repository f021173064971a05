"""The adapter as a process: ``python -m gateway.northbound.mqtt --fd N``."""

from __future__ import annotations

import argparse
import asyncio
import logging
import signal
import sys

from gateway.bridge.api import BridgeError
from gateway.bridge.client import connect_fd
from gateway.log import configure
from gateway.northbound.mqtt.levels import TopicError
from gateway.northbound.mqtt.service import serve
from gateway.northbound.mqtt.settings import SettingsError

BRIDGE_CLOSED = 75
"""Exit code: the core is gone; start again when it is back (EX_TEMPFAIL)."""
UNUSABLE = 78
"""Exit code: the configuration cannot be used; starting again will not help (EX_CONFIG)."""

log = logging.getLogger("gateway.northbound.mqtt")


async def run(fd: int) -> int:
    """Serve the bridge behind the inherited socket ``fd``; the exit code."""
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop.set)
    try:
        bridge = await connect_fd(fd, "mqtt")
        try:
            await serve(bridge, stop)
        finally:
            await bridge.close()
    except BridgeError as error:
        log.warning("%s", error)
        return BRIDGE_CLOSED
    except (SettingsError, TopicError) as error:
        log.error("%s", error)
        return UNUSABLE
    return 0


def main() -> int:
    """Read the arguments and run."""
    parser = argparse.ArgumentParser(prog="gateway.northbound.mqtt", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="inherited socket to the core")
    arguments = parser.parse_args()
    configure("mqtt")
    return asyncio.run(run(arguments.fd))


if __name__ == "__main__":
    sys.exit(main())
