"""What the end of a transaction means to whoever asked, and when a planned read comes again."""

from __future__ import annotations

from collections.abc import Iterable

from gateway.line.interface import (
    Action,
    Answered,
    BlockFailed,
    BlockRead,
    JobDone,
    Plan,
    Refused,
    Silent,
    Write,
)
from gateway.line.reachability import Unit
from gateway.line.schedule import Due, Probe, Waiting, postpone, settle
from gateway.line.transaction import Question, Transaction
from gateway.modbus.pdu import Reply

REFUSED_PACE = 5.0
"""A planned read that was refused is asked again after so many seconds, or its period if longer."""

Ending = Answered | Refused | Silent


def told(done: Transaction, result: Ending, at: float, now: float, again: bool = False) -> list[Action]:
    """The actions that tell of a transaction's end; none for probes and questions on the side. ``at`` is
    since when a result is known. ``again``: a planned read that was not answered is due again at once.
    That is for the first one after a start: it may have met the answer to one of before, and is lost then,
    while the drive's own watchdog runs."""
    question, choice = done.question, done.question.choice
    if question.aside or isinstance(choice, Probe):
        return []
    if isinstance(result, Refused) and isinstance(choice, Due) and not question.whole:
        result = Silent(damaged=True)  # perhaps only the registers beside those wanted are refused
    if isinstance(result, Answered) and result.words:
        result = Answered(result.words[question.skip : question.skip + question.part[1]])
    if isinstance(choice, Waiting):
        return [JobDone(choice.job.id, result, at)]
    return _block_told(choice, question.part, result, at, now, 0.0 if again else now - done.began)


def failed_blocks(plan: Plan, units: Iterable[Unit], now: float) -> list[Action]:
    """All planned reads of units that are held to be down, as failed."""
    down = {unit.facts.unit for unit in units}
    return [
        BlockFailed(block.unit, block.address, block.count, Silent(), now, block.table)
        for block in plan.blocks
        if block.unit in down
    ]


def purpose(question: Question) -> str:
    """Why a request goes out, for the trace."""
    if question.aside:
        return "resynchronise"
    match question.choice:
        case Waiting(job=job):
            return "write" if isinstance(job.request, Write) else "read once"
        case Due():
            return "read"
        case Probe():
            return "probe"


def description(reply: Reply, doubtful: bool) -> str:
    """What came in, for the trace."""
    words = "reply" if reply.exception is None else f"exception {reply.exception:02X}H"
    return f"{words}, not believed" if doubtful else words


def _block_told(
    due: Due, part: tuple[int, int], result: Ending, at: float, now: float, took: float
) -> list[Action]:
    block = due.block
    match result:
        case Answered(words=words):
            due.done += len(words)
            if due.done >= block.count:
                due.done = 0
                settle(due, now)
            return [BlockRead(block.unit, part[0], words, at, block.table)]
        case Refused():
            due.done = 0
            postpone(due, now + max(block.period, REFUSED_PACE))
            return [BlockFailed(block.unit, *part, result, at, block.table)]
        case Silent():
            postpone(due, now + took)  # the others get as much of the line as this one lost
            return []
