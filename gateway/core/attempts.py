"""Writes and commands as the journal remembers them: which have no outcome, and the outcomes of ids. Pure.

The kinds of entries are ``intent`` (the frame with this ``ask`` and ``frame`` is about to be sent),
``unsent`` (it was not, after all) and ``outcome``. An intent that no outcome follows says so with a key
``outcome``.
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import msgspec
from msgspec import field

from gateway.bridge.messages import RunCommand, WriteTag
from gateway.core.chain import Entry
from gateway.tag import Outcome

KEEP_SENT, KEEP_UNSENT = 11_000, 2_000
"""Ids remembered at most, the newest: of commands for which something was sent, and of others. Of the
former a little more than `gateway.core.once` needs, since it takes them in the order in which they ended."""

ABOUT = ("ask", "what", "wanted", "confirm", "by", "id", "client", "ttl")
"""What intents and outcomes tell of their command."""


class Attempt(msgspec.Struct, kw_only=True, omit_defaults=True):
    """A command that came with an id. ``at`` is when it had its outcome (or, while it has none, when it went
    on record), in lived time; ``ttl`` how long it was to wait at most, in seconds; ``content`` is its
    `content`; ``outcome`` is None while there is none."""

    at: float
    ttl: float = 0.0
    content: str = ""
    outcome: Outcome | None = None


class Attempts(msgspec.Struct, kw_only=True):
    """All attempts that matter later."""

    last: int = 0
    """The highest number of an ask; they are counted through all runs."""
    open: dict[int, dict[str, Any]] = field(default_factory=dict)
    """By ask: what is told (`ABOUT`) of those for which something may have been sent and nothing is known."""
    sent: dict[str, Attempt] = field(default_factory=dict)
    """By `key`, the one whose outcome is oldest first: for these something was sent, or may have been."""
    unsent: dict[str, Attempt] = field(default_factory=dict)
    """By `key`, in the same order: for these nothing was sent."""

    def fold(self, entry: Entry) -> None:
        """Take in one entry of the journal."""
        match entry["kind"]:
            case "intent":
                self._intend(entry)
            case "outcome":
                self._end(entry)

    def _intend(self, entry: Entry) -> None:
        self.last = max(self.last, entry["ask"])
        if "outcome" in entry:
            return
        self.open[entry["ask"]] = {name: entry[name] for name in ABOUT if name in entry}
        if "id" in entry:
            name = _key(entry)
            self.unsent.pop(name, None)
            self.sent.pop(name, None)  # an earlier command under the same id says nothing of this one
            self.sent[name] = _attempt(entry)
            forget(self.sent, KEEP_SENT)

    def _end(self, entry: Entry) -> None:
        self.last = max(self.last, entry["ask"])
        self.open.pop(entry["ask"], None)
        if "id" in entry:
            name, attempt = _key(entry), _attempt(entry)
            attempt.outcome = msgspec.convert(entry["outcome"], Outcome)
            done = self.sent if name in self.sent else self.unsent
            done.pop(name, None)
            done[name] = attempt
            forget(self.unsent, KEEP_UNSENT)


def forget(attempts: dict[str, Attempt], keep: int) -> None:
    """Forget the oldest until so many are left."""
    while len(attempts) > keep:
        del attempts[next(iter(attempts))]


def _attempt(entry: Entry) -> Attempt:
    return Attempt(at=entry["lived"], ttl=entry["ttl"], content=content(entry))


def _key(entry: Entry) -> str:
    return key(entry["client"], entry["id"])


def about(ask: int, request: WriteTag | RunCommand, way: tuple[str, str] | None) -> dict[str, Any]:
    """What each entry tells of a request; ``way`` is client and id, if it has one."""
    facts: dict[str, Any] = {"ask": ask, **_asked(request), "by": request.origin, "ttl": request.ttl}
    return facts if way is None else {**facts, "client": way[0], "id": way[1]}


def _asked(request: WriteTag | RunCommand) -> dict[str, Any]:
    confirm = {"confirm": request.confirm} if request.confirm else {}
    if isinstance(request, WriteTag):
        return {"what": request.target, "wanted": request.value, **confirm}
    return {"what": f"{request.drive}.{request.name}", "wanted": dict(request.args), **confirm}


def content(facts: Mapping[str, Any]) -> str:
    """What is asked for, exactly (``true`` is not ``1``), to tell a repetition from another command under the
    same id."""
    wanted = facts["wanted"]
    exactly = sorted(wanted.items()) if isinstance(wanted, Mapping) else wanted
    return sha256(repr((facts["what"], exactly, facts.get("confirm", ""))).encode()).hexdigest()[:32]


def key(client: str, id: str) -> str:
    """The name under which an id of a client is kept."""
    return f"{client}\n{id}"
