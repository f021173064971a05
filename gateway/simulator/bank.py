"""The holding registers of a drive: which exist, what they hold, and the profile's names for them.

An address may mean one thing read and another written, or show what a selector chooses; and a parameter
may be written without being effective yet. So each named value lies in a store of its own kind.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from types import MappingProxyType

from gateway.mapping.profile import Access, Condition, Encoding, Point, Table, Term
from gateway.simulator.refusal import RefusalError
from gateway.simulator.slot import Slot

Span = tuple[int, int]
"""First and last address."""
Cells = dict[int, int]
Exact = Fraction | int
"""A value without rounding: whole where it counts in ones."""
NO_SETTINGS: Mapping[str, Fraction] = MappingProxyType({})


class UnsupportedError(Exception):
    """The mapping asks for something that this simulator does not model; the message says what."""


class Bank:
    """Register contents by address. An address that no span and no point names does not exist.

    ``words`` is what reading shows, ``written`` what was written where nothing can be read. Points
    with ``then`` count only once `activate` has made their registers effective. Raises `UnsupportedError` for
    points in another table.
    """

    def __init__(
        self,
        spans: Iterable[Span],
        points: Mapping[str, Point],
        settings: Mapping[str, Fraction] = NO_SETTINGS,
    ) -> None:
        self.words: Cells = {address: 0 for low, high in spans for address in range(low, high + 1)}
        self.written: Cells = {}
        self.effective: Cells = {}
        self._points = points
        self._settings = settings
        self._stores: dict[str, Cells] = {}
        self._slots: dict[str, Slot] = {}
        self._selected: dict[int, list[Point]] = {}
        for point in points.values():
            if point.table is not Table.HOLDING:
                raise UnsupportedError(f"{point.name}: only holding registers can be simulated")
            self._place(point)

    def _place(self, point: Point) -> None:
        """Find a store for a point, and let its registers exist there."""
        addresses = range(point.address, point.address + point.words)
        if point.access is Access.WRITE:
            store = self.written
        elif point.select:
            store = {}
            for address in addresses:
                self._selected.setdefault(address, []).append(point)
        else:
            store = self.effective if point.then is not None else self.words
        if point.access.readable:
            self.words.update((address, 0) for address in addresses if address not in self.words)
        store.update((address, 0) for address in addresses if address not in store)
        self._stores[point.name] = store
        if not point.cases:
            self._slots[point.name] = Slot(point.address, point.encoding)

    # -- registers --

    def read(self, address: int, count: int, *, bridge: bool = False) -> tuple[int, ...]:
        """``count`` registers from ``address`` on. All of them must exist; with ``bridge`` it is enough
        that one of several does, and the others are 0."""
        wanted = range(address, address + count)
        if not (bridge and count > 1 and any(at in self.words for at in wanted)):
            self._require(wanted, self.words)
        return tuple(self._shown(at) for at in wanted)

    def require_writable(self, address: int, count: int) -> None:
        """Refuse addresses that neither exist for reading nor for writing."""
        self._require(range(address, address + count), self.words.keys() | self.written.keys())

    def _require(self, wanted: range, known: Iterable[int]) -> None:
        if any(at not in known for at in wanted):
            raise RefusalError("illegal_address")

    def store(self, address: int, word: int) -> None:
        """Take a written word over: where something can be written, else where it can be read."""
        (self.written if address in self.written else self.words)[address] = word

    def present(self, address: int) -> int:
        """The word that a write of this address replaces."""
        return self.written[address] if address in self.written else self.words[address]

    def activate(self) -> None:
        """Make all written registers effective."""
        self.effective.update((address, self.words[address]) for address in self.effective)

    def _shown(self, address: int) -> int:
        for point in self._selected.get(address, ()):
            if all(self.exact(name) == constant.value for name, constant in point.select.items()):
                return self._stores[point.name][address]
        return self.words.get(address, 0)

    # -- named values --

    def get(self, name: str) -> float:
        """The value of a point in its unit; bits count as 0 and 1. 0 while no case of it holds."""
        return float(self.exact(name))

    def exact(self, name: str) -> Exact:
        """As `get`, without rounding."""
        slot = self._slot(name)
        return 0 if slot is None else self.value(slot, slot.read(self._stores[name]))

    def raw(self, name: str) -> int:
        """The raw value of a point."""
        slot = self._slot(name)
        return 0 if slot is None else slot.read(self._stores[name])

    def on(self, name: str) -> bool:
        """True when the point is not 0."""
        return self.exact(name) != 0

    def set(self, name: str, value: float) -> None:
        """Show a value in its unit, to the nearest count."""
        slot = self._slot(name)
        if slot is not None:
            count = (value - slot.offset) / slot.scale
            if slot.encoding.times is not None:
                count /= float(self._times(slot.encoding))
            slot.write(self._stores[name], slot.raw(1 - value if slot.encoding.active_low else count))

    def put(self, name: str, raw: int) -> None:
        """Show a raw value."""
        slot = self._slot(name)
        if slot is not None:
            slot.write(self._stores[name], raw)

    def clear(self, names: Iterable[str]) -> None:
        """Set points back to 0."""
        for name in names:
            self.set(name, 0)

    def steady(self, name: str) -> bool:
        """How the point is written down depends on nothing."""
        return name in self._slots and self._points[name].encoding.times is None

    def number(self, name: str) -> Exact | None:
        """The value of a setting or point; None when nothing of that name has one."""
        if name in self._points:
            return self.exact(name)
        return self._settings.get(name)

    def value(self, slot: Slot, raw: int) -> Exact:
        """What a raw value means in the unit."""
        encoding = slot.encoding
        if encoding.active_low:
            return 1 - raw
        if slot.counts:
            return raw
        return Fraction(slot.number(raw)) * encoding.scale * self._times(encoding) + encoding.offset

    # -- conditions --

    def holds(self, condition: Condition) -> bool:
        """True when all terms hold; a name without a value never does."""
        return all(self._term(term) for term in condition)

    def applies(self, condition: Condition) -> bool:
        """As `holds`, but the empty condition is never true."""
        return bool(condition) and self.holds(condition)

    def slot(self, point: Point) -> Slot | None:
        """Where the point lies and how it is to be read now; None while no case of it holds."""
        encoding = self._encoding(point)
        return None if encoding is None else Slot(point.address, encoding)

    def _slot(self, name: str) -> Slot | None:
        return self._slots.get(name) or self.slot(self._points[name])

    def _encoding(self, point: Point) -> Encoding | None:
        if not point.cases:
            return point.encoding
        return next((case.encoding for case in point.cases if self.holds(case.when)), None)

    def _times(self, encoding: Encoding) -> Exact:
        """What multiplies; 1 when that is nothing, so that a value can always be shown."""
        return (self.number(encoding.times) if encoding.times else None) or 1

    def _term(self, term: Term) -> bool:
        value = self.number(term.name)
        return value is not None and any(low <= value <= high for low, high in term.ranges)
