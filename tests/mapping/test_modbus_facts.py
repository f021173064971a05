"""Which requests a drive takes, from its section ``modbus``."""

from __future__ import annotations

import pytest

from tests.mapping.texts import good, small

MODBUS = "modbus: {functions: [03H, 06H, 10H]}"


@pytest.mark.parametrize(
    ("section", "write_one"),
    [
        ("modbus: {functions: [03H, 06H, 10H]}", 0x06),
        ("modbus: {functions: [03H, 10H]}", 0x10),
        ("modbus: {functions: [03H, 06H, 10H], write_one: 10H}", 0x10),
    ],
)
def test_one_register_is_written_with_the_function_that_the_drive_has(section: str, write_one: int) -> None:
    text = small("a: 0001H").replace(MODBUS, section)
    assert good(text).modbus.write_one == write_one


def test_what_is_not_said_is_what_modbus_allows() -> None:
    facts = good(small("a: 0001H")).modbus
    assert (facts.read_max, facts.write_max, facts.bridge) == (125, 123, False)
    assert facts.error_functions == ()


def test_error_functions_are_all_from_the_first_to_the_last() -> None:
    text = small("a: 0001H").replace(MODBUS, "modbus: {functions: [03H, 06H], error_functions: 80H..83H}")
    assert good(text).modbus.error_functions == (0x80, 0x81, 0x82, 0x83)
