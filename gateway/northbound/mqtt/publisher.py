"""From the bridge's updates to messages: the way out, without any waiting."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

from gateway.bridge.api import (
    Batch,
    Catalogue,
    ControlState,
    DriveState,
    Happened,
    OwnerInfo,
    PointInfo,
    Update,
)
from gateway.northbound.mqtt import payload
from gateway.northbound.mqtt.message import Lane, Message
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.rules import Filter, Rule
from gateway.northbound.mqtt.topics import Topics
from gateway.tag import Instant, Quality, Sample, split_tag, tag_of


class Publisher:
    """Publishes one generation of the catalogue."""

    def __init__(self, topics: Topics, catalogue: Catalogue, rules: dict[str, Rule], outbox: Outbox) -> None:
        self._topics = topics
        self._outbox = outbox
        self._catalogue = catalogue
        self._points = _published_points(catalogue, rules)
        self._filters = {tag: Filter.of(rules[tag], point) for tag, point in self._points.items()}
        self._seq: defaultdict[str, int] = defaultdict(int)
        self._ttls = {drive.name: drive.control.ttl for drive in catalogue.drives}
        self._leases: dict[str, bytes] = {}

    def announce(self, now: Instant) -> None:
        """Publish what the drives offer and, until there are values, that there are none; remove from the
        broker what an earlier generation left."""
        for topic in self._outbox.topics - self._own_topics():
            self._outbox.clear(topic)
        known = self._outbox.topics
        for tag in self._points:
            if self._topics.state(*split_tag(tag)) not in known:
                self._state(Sample(tag, None, Quality.WAITING, now.wall, reason="no value yet"), 0)
        for drive in self._catalogue.drives:
            names = [point.name for point in drive.points if tag_of(drive.name, point.name) in self._points]
            meta = payload.meta(drive, self._catalogue.gateway, names)
            self._outbox.retain(self._topics.meta(drive.name), meta)
        for line in self._commanded_lines():
            meta = payload.line_meta(line, self._catalogue.gateway)
            self._outbox.retain(self._topics.meta(line.name), meta)

    def _commanded_lines(self) -> list[OwnerInfo]:
        """The lines whose drives may be commanded all at once."""
        return [line for line in self._catalogue.lines if line.commands]

    def _own_topics(self) -> set[str]:
        own = {self._topics.state(*split_tag(tag)) for tag in self._points}
        for drive in self._catalogue.drives:
            own |= {t(drive.name) for t in (self._topics.meta, self._topics.status, self._topics.lease)}
        own |= {self._topics.meta(line.name) for line in self._commanded_lines()}
        return own | {self._topics.gateway_status}

    def update(self, update: Update, now: float) -> None:
        """Take one update; ``now`` is monotonic seconds."""
        match update:
            case Batch():
                self._batch(update, now)
            case DriveState():
                self._outbox.retain(self._topics.status(update.drive), payload.drive_status(update))
            case ControlState():
                self._control(update)
            case Happened():
                topic = self._topics.event(update.event.drive)
                self._outbox.put(Message(topic, payload.event(update.event), Lane.ANSWER))

    def _control(self, state: ControlState) -> None:
        """Who may command a drive; a lease that is only renewed is no news."""
        lease = payload.lease(state, self._ttls[state.drive])
        if self._leases.get(state.drive) != lease:
            self._leases[state.drive] = lease
            self._outbox.retain(self._topics.lease(state.drive), lease)

    def _batch(self, batch: Batch, now: float) -> None:
        drives: defaultdict[str, list[Sample]] = defaultdict(list)
        for sample in batch.samples:
            known = self._filters.get(sample.tag)
            if known is not None and known.due(sample, now):
                drives[split_tag(sample.tag)[0]].append(sample)
        for drive, samples in drives.items():
            self._drive(drive, samples, batch.skipped, now)

    def _drive(self, drive: str, samples: list[Sample], skipped: int, now: float) -> None:
        """Due samples of one drive: all into ``data``, and into ``state`` what is worth telling."""
        self._seq[drive] += 1
        seq = self._seq[drive]
        message = payload.data(((s, self._points[s.tag]) for s in samples), seq, skipped)
        self._outbox.put(Message(self._topics.data(drive), message, Lane.DATA))
        for sample in samples:
            if self._filters[sample.tag].tell(sample, now):
                self._state(sample, seq)

    def _state(self, sample: Sample, seq: int) -> None:
        topic = self._topics.state(*split_tag(sample.tag))
        self._outbox.retain(topic, payload.state(sample, self._points[sample.tag], seq))

    def lost(self, reason: str, time: int) -> None:
        """Nobody reads the drives any more: everything shown is bad from ``time`` on (nanoseconds)."""
        for drive in self._catalogue.drives:
            gone = DriveState(drive.name, up=False, time=time, reason=reason)
            self._outbox.retain(self._topics.status(drive.name), payload.drive_status(gone))
            self._outbox.retain(self._topics.lease(drive.name), payload.no_lease(reason))
        for tag in self._points:
            bad = Sample(tag, None, Quality.NO_COMMUNICATION, time, reason=reason)
            self._state(bad, self._seq[split_tag(tag)[0]])


def _published_points(catalogue: Catalogue, rules: Iterable[str]) -> dict[str, PointInfo]:
    wanted = set(rules)
    known = {tag_of(owner.name, point.name): point for owner in catalogue.owners for point in owner.points}
    return {tag: point for tag, point in known.items() if tag in wanted}
