"""Who wants which tag how often. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping


class Demands:
    """The demands of all clients. A client is any hashable: sessions are numbers, the core's own
    watchers have names."""

    def __init__(self) -> None:
        self._by_client: dict[int | str, dict[str, float]] = {}
        self._by_tag: dict[str, dict[int | str, float]] = {}

    def change(self, client: int | str, wants: Mapping[str, float | None]) -> bool:
        """Add, change or (None) withdraw demands; True when the shortest period of a tag changed."""
        before = {tag: self.period(tag) for tag in wants}
        for tag, period in wants.items():
            if period is None:
                self._drop(client, tag)
            else:
                self._by_client.setdefault(client, {})[tag] = period
                self._by_tag.setdefault(tag, {})[client] = period
        return any(self.period(tag) != old for tag, old in before.items())

    def leave(self, client: int | str) -> bool:
        """Withdraw everything that a client wanted; as `change`."""
        return self.change(client, dict.fromkeys(self._by_client.get(client, {})))

    def period(self, tag: str) -> float | None:
        """The shortest period anybody wants for a tag."""
        return min(self._by_tag.get(tag, {}).values(), default=None)

    def wanted(self, tag: str) -> Mapping[int | str, float]:
        """Who wants a tag, and how often."""
        return self._by_tag.get(tag, {})

    def watchers(self, tag: str) -> Iterator[int]:
        """The sessions that want a tag."""
        return (client for client in self._by_tag.get(tag, ()) if isinstance(client, int))

    def tags(self) -> Iterator[tuple[str, float]]:
        """Every wanted tag with its shortest period."""
        return ((tag, min(clients.values())) for tag, clients in self._by_tag.items())

    def of(self, client: int | str) -> Mapping[str, float]:
        """What a client wants."""
        return self._by_client.get(client, {})

    def _drop(self, client: int | str, tag: str) -> None:
        tags = self._by_client.get(client, {})
        clients = self._by_tag.get(tag, {})
        tags.pop(tag, None)
        clients.pop(client, None)
        if not tags:
            self._by_client.pop(client, None)
        if not clients:
            self._by_tag.pop(tag, None)
