"""What became of a transaction, in the terms of the line's doctor. Pure."""

from __future__ import annotations

from gateway.line.doctor.doctor import Asked, Doctor
from gateway.line.schedule import Due
from gateway.line.transaction import Transaction, Wire


def asked(wire: Wire, done: Transaction) -> Asked:
    """The request of a transaction."""
    size = wire.framing.size(done.question.request.reply_length)
    return Asked(done.question.unit, done.data, size, done.ends, done.heard_at)


def tell_answered(doctor: Doctor, wire: Wire, done: Transaction, believed: bool, now: float) -> None:
    """Tell the doctor of the reply that a transaction ended with, and note that a planned read was done if it
    is believed."""
    raw, reply = done.seeker.heard, done.reply
    begin = len(raw) - done.seeker.length
    exception = None if reply is None else reply.exception
    doctor.answered(asked(wire, done), raw[begin:], raw[:begin], exception, done.heard_at)
    due = done.question.choice
    if believed and isinstance(due, Due) and not done.question.aside and exception is None:
        doctor.renewed(due.unit, due.read_at, due.block.worst_age, now)
        due.read_at = now
