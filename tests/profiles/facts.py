"""How facts are written down by hand in these tests, independently of the mapping language."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple


class Fact(NamedTuple):
    """One datum of a document."""

    name: str
    register: int
    bits: tuple[int, int] | None = None
    """First and last bit; None: the whole register."""
    exact: str = "1"
    """What one count is worth, as a fraction."""
    unit: str | None = None
    access: str = "read"
    type: str = "u16"
    values: Mapping[int, str] = {}


def bits(register: int, names: str, access: str = "read") -> Iterator[Fact]:
    """The single bits of a register from bit 0 on, as a table prints them; ``-`` is an unused one."""
    for position, name in enumerate(names.split()):
        if name != "-":
            yield Fact(name, register, (position, position), access=access)


def field(
    register: int, first: int, last: int, name: str, values: Mapping[int, str], access: str = "read-write"
) -> Fact:
    """A code of some bits, or one bit whose two meanings have names."""
    return Fact(name, register, (first, last), access=access, values=values)


def counts(register: int, *names: str, access: str = "read") -> Iterator[Fact]:
    """Registers that follow each other and are shown as they are."""
    for offset, name in enumerate(names):
        yield Fact(name, register + offset, access=access)


def amount(register: int, name: str, exact: str, unit: str, access: str = "read", type: str = "u16") -> Fact:
    """A register with a scale."""
    return Fact(name, register, None, exact, unit, access, type)
