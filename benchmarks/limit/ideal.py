"""What a line could do at best: the reads of least wire time, back to back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.wire.drive import LONGEST, READABLE
from benchmarks.wire.settings import LineSettings

REQUEST, REPLY = 8, 5
"""Characters of a request to read, and of its reply beside two for each register."""


@dataclass(frozen=True, slots=True)
class Block:
    """Registers fetched by one transaction."""

    address: int
    count: int

    def cost(self, line: LineSettings) -> float:
        """Seconds of the line: characters, the drive's turnaround, the mandatory silence after it."""
        characters = REQUEST + REPLY + 2 * self.count
        return characters * line.character + line.turnaround + line.silence


def best_blocks(registers: Sequence[int], line: LineSettings) -> list[Block]:
    """The reads of least wire time that fetch all these registers of one drive."""
    wanted = sorted(set(registers))
    best: list[tuple[float, list[Block]]] = [(0.0, [])]
    for end in range(1, len(wanted) + 1):
        choices = []
        for start in range(end):
            block = Block(wanted[start], wanted[end - 1] - wanted[start] + 1)
            if _allowed(block):
                cost, blocks = best[start]
                choices.append((cost + block.cost(line), [*blocks, block]))
        best.append(min(choices, key=lambda choice: choice[0]))
    return best[-1][1]


def shares(registers: Sequence[int], line: LineSettings) -> dict[int, float]:
    """Seconds of the line that each register is worth: its part of the best read that brings it."""
    worth = {}
    for block in best_blocks(registers, line):
        inside = [register for register in registers if 0 <= register - block.address < block.count]
        worth.update(dict.fromkeys(inside, block.cost(line) / len(inside)))
    return worth


def use_of(reads: Mapping[str, int], worth: Mapping[int, float], seconds: float) -> float:
    """The ideal line time of all demanded registers that were fetched, as a share of the time it took.

    ``reads`` are transactions by ``unit,address,count``. Reads that bring what nobody wants, or bring it in
    more transactions than needed, show as a lower share.
    """
    ideal = 0.0
    for key, times in reads.items():
        _, address, count = map(int, key.split(","))
        ideal += times * sum(worth.get(register, 0.0) for register in range(address, address + count))
    return ideal / seconds


def _allowed(block: Block) -> bool:
    last = block.address + block.count - 1
    return block.count <= LONGEST and any(low <= block.address and last <= high for low, high in READABLE)
