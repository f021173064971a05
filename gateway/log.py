"""How every process of the gateway logs: structured, to standard error; pretty for people at a terminal,
one JSON object a line for everybody else. What libraries log goes the same way.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import MutableMapping
from typing import Any, Literal, TextIO

import structlog
from structlog.typing import Processor

Level = Literal["debug", "info", "warning", "error"]


def configure(process: str, level: Level = "info", stream: TextIO | None = None) -> None:
    """Set up logging for this process, named ``process`` in each entry. Call it once, at the start.

    ``stream`` is where to write, None for standard error.
    """
    stream = stream or sys.stderr

    def name_process(_: Any, __: str, entry: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
        entry["process"] = process
        return entry

    common: list[Processor] = [
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
        name_process,
    ]
    structlog.configure(
        processors=[
            structlog.stdlib.filter_by_level,
            *common,
            structlog.stdlib.ProcessorFormatter.wrap_for_formatter,
        ],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=True,
    )
    handler = logging.StreamHandler(stream)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=common, processors=[_strip, *_renderers(stream)]
        )
    )
    logging.basicConfig(handlers=[handler], level=_threshold("warning"), force=True)
    logging.getLogger("gateway").setLevel(_threshold(level))


def _renderers(stream: TextIO) -> list[Processor]:
    if stream.isatty():
        return [structlog.dev.ConsoleRenderer()]
    return [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]


def _strip(logger: Any, name: str, entry: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Take out what structlog put in for its own use."""
    return structlog.stdlib.ProcessorFormatter.remove_processors_meta(logger, name, entry)


def _threshold(level: Level) -> int:
    return int(logging.getLevelNamesMapping()[level.upper()])
