"""Which writes a drive refuses, and for what reason: what its profile says, decided from its registers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from gateway.mapping.profile import Bound, Kind, Limits, Point, Word
from gateway.mapping.twin import Lock, Simulate
from gateway.simulator.amounts import Amounts
from gateway.simulator.bank import Bank, Exact
from gateway.simulator.refusal import RefusalError
from gateway.simulator.slot import Slot

_CHOSEN = (Kind.COMMAND, Kind.SETPOINT, Kind.SWITCH)
"""Kinds whose named values are all that there are; a document may leave out some values of a parameter."""


class Rules:
    """Looks at a write before it is done."""

    def __init__(
        self,
        bank: Bank,
        words: Mapping[int, Word],
        facts: Simulate,
        points: Mapping[str, Point],
        amounts: Amounts,
    ) -> None:
        self._bank = bank
        self._points = points
        self._words = words
        self._facts = facts
        self._amounts = amounts
        self._named: dict[int, list[Point]] = {}
        for point in points.values():
            for address in range(point.address, point.address + point.words):
                self._named.setdefault(address, []).append(point)

    def written(self, address: int, count: int) -> list[Point]:
        """The points that a write of these registers touches."""
        found = [p for at in range(address, address + count) for p in self._writable(at)]
        return list({point.name: point for point in found}.values())

    def check(self, address: int, words: Sequence[int]) -> None:
        """Refuse the write, or do nothing. Registers are looked at in their order."""
        proposed = dict(enumerate(words, address))
        for at in proposed:
            self._check_locks(at)
            self._check_register(at, proposed)

    def _writable(self, address: int) -> list[Point]:
        return [point for point in self._named.get(address, ()) if point.access.writable]

    # -- may it be written now --

    def _check_locks(self, address: int) -> None:
        points = self._named.get(address, [])
        for lock in self._facts.locks:
            if _closes(lock, points) and self._bank.holds(lock.when):
                raise RefusalError(lock.reason)

    def _check_register(self, address: int, proposed: Mapping[int, int]) -> None:
        points = self._writable(address)
        if not points:
            if address in self._named:
                self._refuse("read_only")
            return
        live = [point for point in points if self._bank.holds(point.when)]
        if not live or self._unmet(live, proposed):
            self._refuse("locked")
        self._check_bits(address, points, proposed[address])
        for point in live:
            self._check_value(point, proposed)

    def _refuse(self, why: str) -> None:
        raise RefusalError(self._facts.refuses.get(why, "locked"))

    def _unmet(self, points: Sequence[Point], proposed: Mapping[int, int]) -> bool:
        """A precondition of all fields of the register, or of one that would change, does not hold."""
        closed = [point for point in points if not self._bank.holds(point.only_when)]
        return bool(closed) and (
            len(closed) == len(points) or any(self._changes(p, proposed) for p in closed)
        )

    def _changes(self, point: Point, proposed: Mapping[int, int]) -> bool:
        slot = self._bank.slot(point)
        return slot is not None and slot.read(self._after(slot, {})) != slot.read(self._after(slot, proposed))

    def _after(self, slot: Slot, proposed: Mapping[int, int]) -> dict[int, int]:
        """The registers of a value as they would be."""
        return {at: proposed[at] if at in proposed else self._bank.present(at) for at in slot.addresses}

    # -- is the value a possible one --

    def _check_bits(self, address: int, points: Iterable[Point], word: int) -> None:
        """Bits that nobody names are 0, and constant bits are what they are."""
        fields = [point.encoding for point in points]
        if not all(field.width for field in fields):
            return
        used = 0
        for field in fields:
            used |= ((1 << field.width) - 1) << field.bit
        constant = self._words.get(address)
        mask, bits = (constant.always_mask, constant.always_bits) if constant else (0, 0)
        if word & ~(used | mask) or word & mask != bits:
            raise RefusalError("illegal_value")

    def _check_value(self, point: Point, proposed: Mapping[int, int]) -> None:
        slot = self._bank.slot(point)
        if slot is None:
            self._refuse("locked")
            return
        raw, encoding = slot.read(self._after(slot, proposed)), slot.encoding
        if raw in encoding.special:
            return
        if encoding.values and point.kind in _CHOSEN and raw not in encoding.values:
            raise RefusalError("illegal_value")
        value = Fraction(self._bank.value(slot, raw))
        low, high = self._range(point)
        if (low is not None and value < low) or (high is not None and value > high):
            raise RefusalError("illegal_value")
        if self._is_frequency(point, slot) and abs(value) > self._amounts.max_frequency:
            raise RefusalError("illegal_value")

    def _range(self, point: Point) -> tuple[Exact | None, Exact | None]:
        limits = self._limits(point)
        return (None, None) if limits is None else (self._bound(limits.low), self._bound(limits.high))

    def _limits(self, point: Point) -> Limits | None:
        cases = (case.limits for case in point.cases if self._bank.holds(case.when))
        return next(cases, None) or point.limits

    def _bound(self, bound: Bound) -> Exact | None:
        """A limit that a setting holds is the plant's, not the drive's."""
        if isinstance(bound, str):
            return self._bank.exact(bound) if bound in self._points else None
        return bound

    def _is_frequency(self, point: Point, slot: Slot) -> bool:
        return slot.encoding.symbol == "Hz" and point.name not in self._amounts.points


def _closes(lock: Lock, points: Iterable[Point]) -> bool:
    """True when the lock is about a register with these points, and not to be undone there."""
    names = {point.name for point in points}
    if names & {term.name for term in lock.when}:
        return False
    return not lock.what or bool((names | {point.group for point in points}) & set(lock.what))
