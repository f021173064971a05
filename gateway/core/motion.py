"""What moves the motor in a control word, and what has to stand there when another bit of it is written
(H7, H8). Pure.

A frame that closes a terminal or gives a pulse carries the run bits too. In a word that can be read they stay
as they are read. One that cannot is written from what was commanded last, and that may be over: somebody else
stopped the drive, it tripped, or a command to all drives of the line went past its word. So what the drive
shows of the motor decides then; where that and what was commanded do not fit together, nothing is written.
Each function that yields is a part of a procedure.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any

from gateway.core.conditions import contradicted, holds
from gateway.core.drive import Commanded, Drive, is_polled
from gateway.core.guard import Ended, refuse, starts_motor
from gateway.core.procedure import Ask, Effect, read
from gateway.core.saying import explain
from gateway.core.store import Store
from gateway.line.interface import Answered, Priority, Read
from gateway.mapping.profile import Command, Condition, Constant
from gateway.modbus.encoding import encode, extract
from gateway.tag import Cause, Quality

ALL = "_all"
"""What the names of commands to all drives of a line end with; the rest is the name of the same to one."""

STOP = "stop"
FAULT = "fault"

Raws = Mapping[str, int]


@dataclass(frozen=True, slots=True)
class Shown:
    """What a drive shows: the command whose proof holds (None: no single one), and whether it has tripped."""

    name: str | None
    fault: bool


@dataclass(frozen=True, slots=True)
class Beside:
    """What a frame has to say of the motor, and what must still hold when it goes out."""

    raws: Raws
    condition: Condition = ()


AS_IT_IS = Beside({})


def constants(drive: Drive, command: Command | None) -> dict[str, int]:
    """The raw values that a command writes to fields of control words, whoever gives it."""
    found: dict[str, int] = {}
    for step in command.steps if command else ():
        for name, value in step.write.items():
            point = drive.profile.points[name]
            word = drive.profile.words.get(point.address)
            if isinstance(value, Constant) and word is not None and word.image and not point.pulse:
                found[name] = encode(point.encoding, value.value)
    return found


def lacking(drive: Drive, raws: Raws) -> list[str]:
    """The fields that move the motor, in words of which these raw values are a part. None where one of them
    is itself written: then that is a command to the motor."""
    points = drive.profile.points
    words = {points[name].address for name in raws if drive.word(points[name]) is not None}
    if not words:
        return []
    moving = dict.fromkeys(name for command in _motions(drive) for name in constants(drive, command))
    if not moving.keys().isdisjoint(raws):
        return []
    return [name for name in moving if points[name].address in words]


def note(drive: Drive, raws: Raws, *, shown: bool = False) -> None:
    """These raw values were sent: if they move or stop the motor, that is what it was commanded last."""
    fields = [name for name in raws if drive.word(drive.profile.points[name]) is not None]
    if any(name in constants(drive, command) for name in fields for command in _motions(drive)):
        name = _command_in(drive, raws)
        drive.commanded = None if name is None else Commanded(name, shown=shown)


def note_shown(drive: Drive, raws: Raws) -> None:
    """The drive shows what these raw values command."""
    if drive.commanded is not None and drive.commanded.name == _command_in(drive, raws):
        drive.commanded.shown = True


def beside(ask: Ask, store: Store, raws: Raws, fresh: Mapping[int, int]) -> Generator[Effect, Any, Beside]:
    """What a frame that writes these values to one drive has to say of the motor; ``fresh`` are the words
    that were just read.

    Raises:
        Ended: if that cannot be told.
    """
    drive = ask.drive
    fields = lacking(drive, raws)
    if not fields:
        return AS_IT_IS
    points = drive.profile.points
    readable = all(points[name].address in fresh for name in fields)
    held = _command_in(drive, _held(drive, fields, fresh))
    if readable and _speaks_for_itself(drive, store, held):
        return AS_IT_IS
    shown = yield from show(ask, store, drive)
    name = _by_word(drive, held, shown) if readable else _by_image(drive, held, shown)
    command = drive.profile.commands[name]
    given = {field: raw for field, raw in constants(drive, command).items() if field in fields}
    return Beside(given, command.steps[-1].until if name == shown.name else ())


def show(ask: Ask, store: Store, drive: Drive) -> Generator[Effect, Any, Shown]:
    """What a drive shows of its motor, read now.

    Raises:
        Ended: if it could not be read.
    """
    points = drive.profile.points
    proofs = {command.name: command.steps[-1].until for command in _motions(drive)}
    names = {term.name for proof in proofs.values() for term in proof if not term.setting}
    names |= {FAULT} & points.keys()
    registers = {(points[name].address, points[name].words) for name in names if is_polled(points[name])}
    for address, count in sorted(registers):
        finished = yield from read(Read(drive.unit, address, count), Priority.COMMAND, ask.deadline)
        if not isinstance(finished.result, Answered):
            text = f"whether the motor of {drive.name} runs could not be read first"
            raise refuse(Cause.PRECONDITION, f"{text}: {explain(drive, finished)}")
    found = [name for name, proof in proofs.items() if proof and _holds(drive, store, proof)]
    fault = store.get(drive.tag(FAULT))
    tripped = fault is not None and fault.sample.quality is Quality.GOOD and bool(fault.sample.value)
    return Shown(found[0] if len(found) == 1 else None, tripped)


def commanded(ask: Ask, store: Store, drive: Drive) -> Generator[Effect, Any, str]:
    """The command that a drive has: what it shows, which must be what it was given last; of one that has
    tripped, what its word says.

    Raises:
        Ended: if that does not fit together.
    """
    points = drive.profile.points
    fields = list(constants(drive, drive.profile.commands.get(STOP)))
    fresh: dict[int, int] = {}
    for address in {points[name].address for name in fields if points[name].access.readable}:
        finished = yield from read(Read(drive.unit, address, 1), Priority.COMMAND, ask.deadline)
        if not isinstance(finished.result, Answered):
            text = f"{drive.name}: register {address:04X}H could not be read first"
            raise refuse(Cause.PRECONDITION, f"{text}: {explain(drive, finished)}")
        fresh[address] = finished.result.words[0]
    held = _command_in(drive, _held(drive, fields, fresh))
    shown = yield from show(ask, store, drive)
    last = drive.commanded
    told = held if last is None else last.name
    if shown.name is not None and shown.name == told:
        return shown.name
    if shown.fault and held is not None and fresh:
        return held
    if told == STOP and last is not None and not last.shown:
        return STOP
    raise refuse(
        Cause.PRECONDITION, f"{drive.name} does not show what it was commanded last; stop all of them first"
    )


def _speaks_for_itself(drive: Drive, store: Store, held: str | None) -> bool:
    """Whether a word that was read tells what the motor was commanded. Where a whole line can be commanded at
    once, that was perhaps done past this word."""
    last = drive.commanded
    if drive.profile.broadcast is None:
        return True
    if last is None:
        runs = [command for command in _motions(drive) if command.name != STOP]
        return any(contradicted(drive, store, run.only_when) is not None for run in runs)
    return not last.to_all or last.name == held


def _by_word(drive: Drive, held: str | None, shown: Shown) -> str:
    last = drive.commanded
    if last is None and held is not None and held == shown.name:
        return held
    if last is not None and last.name == STOP and (shown.name == STOP or not last.shown):
        return STOP
    raise _refusal(
        drive, f"its command word says {held or 'nothing that is known'}, and it shows {_words(shown)}"
    )


def _by_image(drive: Drive, held: str | None, shown: Shown) -> str:
    last = drive.commanded
    under_way = last is not None and not last.shown
    if shown.name is not None and shown.name == held:
        if last is not None and last.name == held:
            last.shown = True
        return held
    if shown.name == STOP:  # whoever stopped it: it must not start by this frame
        if held is None or shown.fault or not under_way:
            return STOP
        raise _refusal(drive, f"{held} was commanded, and it does not show that yet")
    if held == STOP and (under_way or drive.expected.runs is None):
        return STOP  # it still slows down, or a switch of ours drives it
    if held is not None and held != STOP and under_way:
        return held  # it still turns round
    told = f"{held} was commanded last" if held else "what it was commanded is not known"
    raise _refusal(drive, f"it shows {_words(shown)}, and {told}")


def _refusal(drive: Drive, why: str) -> Ended:
    text = f"this would write the run command of {drive.name} as well, but {why}"
    return refuse(Cause.PRECONDITION, f"{text}; give it a stop or a run command first")


def _words(shown: Shown) -> str:
    return f"that of {shown.name}" if shown.name else "neither a run nor a stop"


def _motions(drive: Drive) -> list[Command]:
    """The commands that move or stop the motor."""
    return [c for c in drive.profile.commands.values() if c.name.removesuffix(ALL) == STOP or starts_motor(c)]


def _held(drive: Drive, fields: list[str], fresh: Mapping[int, int]) -> dict[str, int]:
    """What a word that was read, or else what was last commanded, says of these fields."""
    words = {**drive.image, **fresh}
    points = {name: drive.profile.points[name] for name in fields}
    return {
        name: extract(point.encoding, (words[point.address],))
        for name, point in points.items()
        if point.address in words
    }


def _command_in(drive: Drive, raws: Raws) -> str | None:
    """The command that these values of control fields are, as far as the words go in which they stand."""
    points = drive.profile.points
    words = {points[name].address for name in raws}
    for command in _motions(drive):
        wanted = {n: raw for n, raw in constants(drive, command).items() if points[n].address in words}
        if wanted and all(raws.get(name) == raw for name, raw in wanted.items()):
            return command.name
    return None


def _holds(drive: Drive, store: Store, proof: Condition) -> bool:
    for term in proof:
        if term.setting:
            if not holds(term, float(drive.config.settings[term.name])):
                return False
            continue
        held = store.get(drive.tag(term.name))
        if held is None or held.sample.quality is not Quality.GOOD or not holds(term, held.sample.value):
            return False
    return True
