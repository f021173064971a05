"""The section ``simulate`` as it stands in YAML: assumptions for the simulated twin of a drive.

`gateway.mapping.twins` makes a `gateway.mapping.twin.Simulate` out of it.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, PlainValidator, WithJsonSchema

from gateway.mapping.forms import FormError
from gateway.mapping.scalars import ANY_SCHEMA, Duration, Integer, Name, Text, UnitOf
from gateway.mapping.shape import Shape


def _one_or_more(value: object) -> list[str]:
    values = value if isinstance(value, list) else [value]
    texts = [text for text in values if isinstance(text, str)]
    if not texts or len(texts) != len(values):
        raise FormError("a value or a list of values is expected here", "write it like 3 or [3, 4]")
    return texts


Texts = Annotated[
    list[str],
    PlainValidator(_one_or_more),
    WithJsonSchema({"anyOf": [ANY_SCHEMA, {"type": "array", "items": ANY_SCHEMA, "minItems": 1}]}),
]
Terms = dict[str, Texts]
"""A condition: name to a value, a range, or a list of them."""
Reason = Literal[
    "illegal_function", "illegal_address", "illegal_count", "illegal_value", "locked", "undervoltage", "busy"
]


class RawLock(Shape):
    """Writes that are refused while a condition holds."""

    when: Terms
    what: list[Name] = Field(default_factory=list)
    reason: Reason = "locked"


class RawExternal(Shape):
    """An external fault and what demands it."""

    trips: Name
    by: Name | None = None
    action: Name | None = None


class RawSimulate(Shape):
    """Assumptions for the simulated twin; nothing but the simulator looks at them."""

    factory: dict[str, Texts] = Field(default_factory=dict)
    units: dict[str, UnitOf] = Field(default_factory=dict)
    max_frequency: Text | None = None
    base_frequency: Text | None = None
    acceleration: Text | None = None
    deceleration: Text | None = None
    fast_deceleration: Text | None = None
    run_when: Terms | None = None
    frequency_when: Terms | None = None
    panel_frequency: Name | None = None
    panel_frequency_when: Terms | None = None
    coast_when: Terms | None = None
    forward_only_when: Terms | None = None
    initialise_when: Terms | None = None
    shows: dict[str, Texts] = Field(default_factory=dict)
    codes: dict[str, dict[str, Integer]] = Field(default_factory=dict)
    history: list[Name] = Field(default_factory=list)
    alarms: dict[str, Integer] = Field(default_factory=dict)
    external_fault: RawExternal | None = None
    reset: Name | None = None
    reset_when: Terms | None = None
    actions: dict[str, Literal["decelerate", "coast", "decelerate_fast", "keep_running"]] = Field(
        default_factory=dict
    )
    comm_timeout: Duration | None = None
    locks: list[RawLock] = Field(default_factory=list)
    refuses: dict[Literal["read_only", "locked"], Reason] = Field(default_factory=dict)
    activates: Name | None = None
    stores: Name | None = None
    saving: Duration | None = None
    restarts: dict[str, Text] = Field(default_factory=dict)
    restart_time: Duration | None = None
