"""Commands on their way in, and their answers on the way out."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from gateway.bridge.api import DriveInfo, OwnerInfo
from gateway.northbound.mqtt import payload
from gateway.northbound.mqtt.message import Incoming, Lane, Message
from gateway.northbound.mqtt.once import Entry, Once
from gateway.northbound.mqtt.order import (
    STOPS,
    Order,
    has_member,
    read_order,
    read_own_order,
    read_unknown_order,
)
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.request import TEXT_LIMIT, RejectedError, lenient_id, refused
from gateway.northbound.mqtt.runner import LIMIT, Runner
from gateway.northbound.mqtt.topics import Target, Topics
from gateway.tag import Cause, Instant, Outcome, Verdict, own_name, tag_of

RETAINED = "retained: a command is meant once, now (publish it without retain, and clear the topic)"

OVERTAKEN = Outcome(
    verdict=Verdict.SUPERSEDED, cause=Cause.SUPERSEDED, reason="a stop that came later took its place"
)

SHOWN = 1000
"""Bytes of a payload that are shown in the journal at most."""

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Reply:
    """Where an answer goes and what it answers. ``repeated``: to a repetition of a command."""

    topics: tuple[str, ...]
    id: str | int | None
    correlation: bytes | None
    repeated: bool = False


class Commander:
    """Takes the commands of one broker for the drives of one catalogue, and for lines as a whole.

    Messages for other drives are left alone: another gateway answers those.
    """

    def __init__(
        self,
        topics: Topics,
        drives: Iterable[OwnerInfo],
        runner: Runner,
        outbox: Outbox,
        clock: Callable[[], Instant],
    ) -> None:
        self._topics = topics
        self._drives = {drive.name: drive for drive in drives}
        self._members = {name: self._members_of(name) for name in self._drives}
        self._stopped: dict[str, float] = {}
        """When the latest stop of each drive came (monotonic)."""
        self._runner = runner
        self._outbox = outbox
        self._clock = clock
        self._once: Once[Reply] = Once()
        self.closing = False
        """Set to refuse everything but stops."""

    def urgent(self, incoming: Incoming) -> bool:
        """True for a stop: it is to be received before what came earlier. What it overtakes so is not carried
        out after it."""
        target = self._topics.command(incoming.topic)
        if target is None or target.name not in STOPS or incoming.retain:
            return False
        return any(command.name == target.name for command in self._drives[target.drive].commands)

    def receive(self, incoming: Incoming) -> None:
        """Take one message. Returns at once; the answer comes when there is one."""
        target = self._topics.command(incoming.topic)
        if target is None:
            return
        if incoming.retain:
            self._refuse_retained(target, incoming)
            return
        try:
            order = self._read(target, incoming)
        except RejectedError as error:
            what, by = tag_of(target.drive, target.name or target.place), lenient_id(incoming.payload)[1]
            self._runner.turn_away(what, _shown(incoming.payload), by, error.outcome)
            self._answer(self._reply(target, error.id, incoming), error.outcome)
            return
        self._begin(order, self._reply(target, order.id, incoming), incoming.arrived.mono)

    def _read(self, target: Target, incoming: Incoming) -> Order:
        """The order in a message.

        Raises:
            RejectedError: also when the drive has what would be at the topic by its name, and the site calls
                it otherwise.
        """
        owner = self._drives[target.drive]
        if target.name:
            read = read_own_order if target.own else read_order
            return read(owner, target.name, incoming)
        log.warning("nothing can be commanded at %s", incoming.topic)
        if len(target.place) > TEXT_LIMIT or has_member(owner, target.place):
            reason = "nothing can be commanded at this topic (the drive's meta topic tells what there is)"
            raise RejectedError(refused(Cause.UNKNOWN_TAG, reason), lenient_id(incoming.payload)[0])
        return read_unknown_order(owner, target.place, incoming)

    def _refuse_retained(self, target: Target, incoming: Incoming) -> None:
        """A retained command is an old one that the broker repeats to whoever connects; told as an event
        too, because its sender may be long gone. (An empty one only clears the topic.)"""
        if not incoming.payload:
            return
        id, by = lenient_id(incoming.payload)
        log.warning("retained command on %s refused", incoming.topic)
        name = target.name or target.place
        event = payload.command_refused(name, Cause.RETAINED, RETAINED, by, incoming.arrived.wall)
        self._outbox.put(Message(self._topics.event(target.drive), event, Lane.ANSWER))
        outcome = refused(Cause.RETAINED, RETAINED)
        self._runner.turn_away(tag_of(target.drive, name), _shown(incoming.payload), by, outcome)
        self._answer(self._reply(target, id, incoming), outcome)

    def _begin(self, order: Order, reply: Reply, arrived: float) -> None:
        if order.is_stop:
            self._stopped.update(dict.fromkeys(self._members[order.drive], arrived))
            self._runner.stop(order, lambda outcome: self._answer(reply, outcome))
        elif (first := self._once.find(order.key, self._clock().mono)) is not None:
            self._repeat(first, order, replace(reply, repeated=True))
        elif self._overtaken(order, arrived):
            self._supersede(order, reply)
        elif self.closing:
            self._refuse(order, reply, Cause.SHUTTING_DOWN, "the gateway is being stopped")
        elif self._runner.full:
            self._refuse(order, reply, Cause.OVERFLOW, f"{LIMIT} commands are under way already")
        else:
            waited = self._clock().mono - arrived
            self._start(replace(order, ttl=max(0.0, order.ttl - waited)), reply)

    def _members_of(self, name: str) -> frozenset[str]:
        """The drives that a command for this drive or line concerns."""
        drives = [drive for drive in self._drives.values() if isinstance(drive, DriveInfo)]
        return frozenset(drive.name for drive in drives if name in (drive.name, own_name(drive.line)))

    def _overtaken(self, order: Order, arrived: float) -> bool:
        """True when one of its drives was told to stop by somebody who came later, but was received before.
        What is for the gateway itself moves no motor."""
        stops = [self._stopped.get(drive, arrived) for drive in self._members[order.drive]]
        return not order.own and any(stop > arrived for stop in stops)

    def _supersede(self, order: Order, reply: Reply) -> None:
        """Remembered like a command that was begun: sent again, it must not follow the stop either."""
        self._once.begin(order.key, order.fingerprint)
        self._once.finish(order.key, OVERTAKEN, self._clock().mono)
        self._turn_away(order, reply, OVERTAKEN)

    def _start(self, order: Order, reply: Reply) -> None:
        self._once.begin(order.key, order.fingerprint)

        def done(outcome: Outcome) -> None:
            others = self._once.finish(order.key, outcome, self._clock().mono)
            for waiting in (reply, *others):
                self._answer(waiting, outcome)

        self._runner.start(order, done)

    def _repeat(self, first: Entry[Reply], order: Order, reply: Reply) -> None:
        """The same again: the first one's answer, now or when it is there. Anything else under the same
        id cannot be told from a mistake."""
        if first.content != order.fingerprint:
            reason = "this id was used a moment ago for something else (give each command its own)"
            self._refuse(order, replace(reply, repeated=False), Cause.DUPLICATE, reason)
        elif first.outcome is not None:
            self._answer(reply, first.outcome)
        elif not first.wait(reply):
            # anything said now under this id would be taken for the outcome of what is still under way
            log.warning("repetition of a command under way passed over: too many wait for its answer")

    def _refuse(self, order: Order, reply: Reply, cause: Cause, reason: str) -> None:
        self._turn_away(order, reply, refused(cause, reason))

    def _turn_away(self, order: Order, reply: Reply, outcome: Outcome) -> None:
        self._runner.turn_away(tag_of(order.drive, order.name), order.content, order.by, outcome)
        self._answer(reply, outcome)

    def _reply(self, target: Target, id: str | int | None, incoming: Incoming) -> Reply:
        topics = [self._topics.ack(target)]
        if incoming.response_topic is not None and self._topics.foreign(incoming.response_topic):
            topics.append(incoming.response_topic)
        return Reply(tuple(topics), id, incoming.correlation)

    def _answer(self, reply: Reply, outcome: Outcome) -> None:
        answer = payload.outcome(reply.id, outcome, self._clock().wall, reply.repeated)
        for topic in reply.topics:
            self._outbox.put(Message(topic, answer, Lane.ANSWER, reply.correlation))


def _shown(payload: bytes) -> str:
    """A payload for the journal, which keeps the beginning of it."""
    return payload[:SHOWN].decode("utf-8", "replace")
