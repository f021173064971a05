"""What is still to be sent, in memory and bounded, so that a dead broker costs nothing but history.

Retained topics are also remembered as they should stand at the broker, because each new connection
publishes them all again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import count

from gateway.northbound.mqtt.message import Lane, Message

LIMIT = 1000
"""Most answers and events, and most data messages, that wait; then the oldest goes."""


class Outbox:
    """Three lanes of waiting messages. ``dropped`` counts those that were lost for want of room."""

    def __init__(self) -> None:
        self.dropped = 0
        self.on_put: Callable[[], None] = lambda: None
        """Called after each message that is put in."""
        self._online = False
        self._kept: dict[str, Message] = {}
        self._number = count()
        self._lanes: dict[Lane, dict[str | int, Message]] = {lane: {} for lane in Lane}

    def __len__(self) -> int:
        return sum(len(lane) for lane in self._lanes.values())

    def put(self, message: Message) -> None:
        """Add a message; on a retained topic it takes the place of the one that waits."""
        self._add(message)
        self.on_put()

    def retain(self, topic: str, payload: bytes) -> None:
        """Set what a retained topic shows."""
        message = Message(topic, payload, Lane.STATE)
        self._kept[topic] = message
        self.put(message)

    def clear(self, topic: str) -> None:
        """Remove a retained topic from the broker (an empty payload does it)."""
        self._kept.pop(topic, None)
        self.put(Message(topic, b"", Lane.STATE))

    @property
    def topics(self) -> frozenset[str]:
        """The retained topics that are ours."""
        return frozenset(self._kept)

    def take(self) -> Message | None:
        """The next message to send, or None; nothing is given out while there is no connection."""
        if not self._online:
            return None
        for lane in self._lanes.values():
            if lane:
                return lane.pop(next(iter(lane)))
        return None

    def connected(self, last: tuple[str, bytes]) -> None:
        """A connection stands: everything retained is to be published again, and ``last`` (a retained
        topic and its payload) after all of it."""
        self._online = True
        self._kept.pop(last[0], None)
        self._lanes[Lane.STATE].update(self._kept)
        self.retain(*last)

    def disconnected(self, unconfirmed: Iterable[Message] = ()) -> None:
        """The connection is gone. Of what it had not confirmed, answers and events are sent again."""
        self._online = False
        again = [message for message in unconfirmed if message.lane is Lane.ANSWER]
        self._requeue([*again, *self._drain(Lane.ANSWER)])
        self._requeue(self._drain(Lane.DATA))

    def _drain(self, lane: Lane) -> list[Message]:
        messages = list(self._lanes[lane].values())
        self._lanes[lane].clear()
        return messages

    def _requeue(self, messages: Iterable[Message]) -> None:
        for message in messages:
            self._add(message)

    def _add(self, message: Message) -> None:
        lane = self._lanes[message.lane]
        lane.pop(message.topic, None)
        lane[self._key(message)] = message
        if message.lane is not Lane.STATE and len(lane) > LIMIT:
            lane.pop(next(iter(lane)))
            self.dropped += 1

    def _key(self, message: Message) -> str | int:
        latest_only = message.lane is Lane.STATE or (message.lane is Lane.DATA and not self._online)
        return message.topic if latest_only else next(self._number)
