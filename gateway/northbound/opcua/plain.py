"""asyncua's constructors for plain numbers and texts.

asyncua annotates them with integer classes of its own that it does not itself use.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any, cast

from asyncua import ua


def node_id(identifier: int | str | bytes, namespace: int = 0) -> ua.NodeId:
    """A NodeId; without a namespace, one that the OPC UA specification assigned."""
    return ua.NodeId(cast("Any", identifier), cast("Any", namespace))


def status(code: int) -> ua.StatusCode:
    """A StatusCode, from a number of ``ua.StatusCodes``."""
    return ua.StatusCode(cast("Any", code))


def data_value(
    variant: ua.Variant, code: int, source: datetime | None = None, server: datetime | None = None
) -> ua.DataValue:
    """A DataValue with the source's and the server's time, both UTC; None: not told."""
    return ua.DataValue(
        variant,
        status(code),
        SourceTimestamp=cast("Any", source),
        ServerTimestamp=cast("Any", server),
    )
