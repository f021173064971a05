"""The clients of the core: sessions over a socket, or in the same process. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from gateway.bridge.api import Batch, Periods
from gateway.bridge.messages import Response
from gateway.core.demands import Demands
from gateway.tag import Role, Sample


@dataclass(slots=True)
class Client:
    """One session: what it calls itself and the highest role it may claim for its users."""

    name: str
    ceiling: Role
    batches: int = 0


class Clients:
    """Who is connected, and who is to be told what. ``tell`` sends a message to a session."""

    def __init__(self, demands: Demands, tell: Callable[[int, Response], None]) -> None:
        self._clients: dict[int, Client] = {}
        self._demands = demands
        self._tell = tell

    def join(self, session: int, name: str, ceiling: Role) -> None:
        """A client connected."""
        self._clients[session] = Client(name, ceiling)

    def leave(self, session: int) -> None:
        """A client is gone."""
        self._clients.pop(session, None)

    def get(self, session: int) -> Client | None:
        """The client of a session."""
        return self._clients.get(session)

    def name(self, session: int) -> str:
        """What a session calls itself."""
        client = self._clients.get(session)
        return client.name if client else ""

    def ceiling(self, session: int) -> Role:
        """The highest role that a session may claim for its users."""
        client = self._clients.get(session)
        return client.ceiling if client else Role.VIEWER

    def names(self) -> Iterator[str]:
        """What the clients call themselves."""
        return (client.name for client in self._clients.values())

    def tell(self, session: int, message: Response) -> None:
        """Send a message to one client, if it is still there."""
        if session in self._clients:
            self._tell(session, message)

    def tell_all(self, message: Response) -> None:
        """Send a message to every client."""
        for session in self._clients:
            self._tell(session, message)

    def periods(self, changed: Mapping[str, float]) -> None:
        """Tell each client the new periods of those of the tags that it watches."""
        for session in self._clients:
            wanted = {tag: period for tag, period in changed.items() if tag in self._demands.of(session)}
            if wanted:
                self._tell(session, Periods(wanted))

    def publish(self, samples: Iterable[Sample]) -> None:
        """Send each client those of the samples that it watches, as one batch."""
        by_session: dict[int, list[Sample]] = {}
        for sample in samples:
            for session in self._demands.sessions(sample.tag):
                by_session.setdefault(session, []).append(sample)
        for session, wanted in by_session.items():
            self.batch(session, wanted)

    def batch(self, session: int, samples: list[Sample]) -> None:
        """Send one client a batch."""
        client = self._clients.get(session)
        if client is not None and samples:
            client.batches += 1
            self._tell(session, Batch(client.batches, tuple(samples)))
