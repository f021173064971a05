"""The OPC UA adapter as a process: ``python -m gateway.northbound.opcua --fd N``."""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import signal
import sys

import structlog

from gateway.bridge.api import BridgeError
from gateway.bridge.client import connect_fd
from gateway.log import configure
from gateway.northbound.opcua.server import serve
from gateway.northbound.opcua.settings import SettingsError

_log = structlog.get_logger(__name__)


def main(argv: list[str] | None = None) -> int:
    """Serve until told to stop. 0: stopped; 75: the core went away, start again; 78: wrong settings."""
    parser = argparse.ArgumentParser(prog="python -m gateway.northbound.opcua", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="number of the inherited bridge socket")
    configure("opcua")
    logging.getLogger("asyncua.server.uaprocessor").addFilter(_is_not_a_clients_mistake)
    return asyncio.run(run(parser.parse_args(argv).fd))


def _is_not_a_clients_mistake(record: logging.LogRecord) -> bool:
    """asyncua logs every refused request as an error; the client has been told, that is enough."""
    return not str(record.msg).startswith("sending service fault")


async def run(fd: int) -> int:
    """Serve the bridge at ``fd``; returns the exit code."""
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    try:
        bridge = await connect_fd(fd, "opcua")
        try:
            await serve(bridge, stop)
        finally:
            await bridge.close()
    except SettingsError as error:
        _log.error("settings refused", reason=str(error))
        return os.EX_CONFIG
    except (BridgeError, OSError) as error:
        _log.error("ended", reason=str(error))
        return os.EX_TEMPFAIL
    return os.EX_OK


if __name__ == "__main__":
    sys.exit(main())
