"""Who wants which tag how often. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gateway.tag import split_tag

Client = int | str
"""Sessions are numbers; the core's own watchers have names."""


class Demands:
    """The demands of all clients."""

    def __init__(self) -> None:
        self._by_client: dict[Client, dict[str, float]] = {}
        self._by_tag: dict[str, dict[Client, float]] = {}
        self._by_drive: dict[str, dict[str, None]] = {}
        self._sessions: dict[str, tuple[int, ...]] = {}

    def change(self, client: Client, wants: Mapping[str, float | None]) -> list[str]:
        """Add, change or (None) withdraw demands; the tags whose shortest period changed."""
        before = {tag: self.period(tag) for tag in wants}
        for tag, period in wants.items():
            if period is None:
                self._drop(client, tag)
            else:
                self._add(client, tag, period)
        return [tag for tag, old in before.items() if self.period(tag) != old]

    def leave(self, client: Client) -> list[str]:
        """Withdraw everything that a client wanted; as `change`."""
        return self.change(client, dict.fromkeys(self._by_client.get(client, {})))

    def period(self, tag: str) -> float | None:
        """The shortest period anybody wants for a tag."""
        return min(self._by_tag.get(tag, {}).values(), default=None)

    def wanted(self, tag: str) -> Mapping[Client, float]:
        """Who wants a tag, and how often."""
        return self._by_tag.get(tag, {})

    def sessions(self, tag: str) -> tuple[int, ...]:
        """The sessions that want a tag."""
        return self._sessions.get(tag, ())

    def tags_of(self, drive: str) -> Iterator[tuple[str, float]]:
        """Every wanted tag of a drive with its shortest period."""
        return ((tag, min(self._by_tag[tag].values())) for tag in self._by_drive.get(drive, ()))

    def of(self, client: Client) -> Mapping[str, float]:
        """What a client wants."""
        return self._by_client.get(client, {})

    def _add(self, client: Client, tag: str, period: float) -> None:
        self._by_client.setdefault(client, {})[tag] = period
        self._by_tag.setdefault(tag, {})[client] = period
        self._by_drive.setdefault(split_tag(tag)[0], {})[tag] = None
        self._note_sessions(tag)

    def _drop(self, client: Client, tag: str) -> None:
        tags = self._by_client.get(client, {})
        clients = self._by_tag.get(tag, {})
        tags.pop(tag, None)
        clients.pop(client, None)
        if not tags:
            self._by_client.pop(client, None)
        if not clients and self._by_tag.pop(tag, None) is not None:
            del self._by_drive[split_tag(tag)[0]][tag]
        self._note_sessions(tag)

    def _note_sessions(self, tag: str) -> None:
        """Keep the sessions of a tag apart: they are asked for with every sample."""
        sessions = tuple(client for client in self._by_tag.get(tag, ()) if isinstance(client, int))
        if sessions:
            self._sessions[tag] = sessions
        else:
            self._sessions.pop(tag, None)
