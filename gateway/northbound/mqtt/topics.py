"""The names of the gateway's topics, and which names can be levels of a topic.

::

    <site>/<drive>/state/<point>            retained: the present value
    <site>/<drive>/data                     values that were read together
    <site>/<drive>/event                    what happened
    <site>/<drive>/meta                     retained: points and commands
    <site>/<drive>/status                   retained: does the drive answer
    <site>/<drive>/cmd/<point or command>   to the gateway
    <site>/<drive>/ack/<point or command>   the answer
    <site>/_gateway/<gateway>/status        retained: birth and will
"""

from __future__ import annotations

from dataclasses import dataclass

RESERVED = "_gateway"
"""Stands where a drive's name would stand; no drive may have this name."""


class TopicError(ValueError):
    """A name that cannot be a level of a topic."""


def check_level(name: str) -> str:
    """Give ``name`` back if it can be one level of a topic on every broker, else raise `TopicError`."""
    if not name or any(c in "/+#" or c.isspace() or not c.isprintable() for c in name):
        raise TopicError(f"{name!r} cannot be part of an MQTT topic: no /, +, # or spaces (rename it)")
    return name


def check_drive(name: str) -> str:
    """As `check_level`, for a name that stands where a drive's does."""
    if name == RESERVED:
        raise TopicError(
            f"a drive cannot be named {RESERVED}: the gateway's own topics are there (rename it)"
        )
    return check_level(name)


@dataclass(frozen=True, slots=True)
class Topics:
    """The topics of one gateway."""

    site: str
    gateway: str

    def __post_init__(self) -> None:
        check_level(self.site)
        check_level(self.gateway)
        if self.site.startswith("$"):
            raise TopicError(f"site {self.site!r}: topics that begin with $ belong to the broker (rename it)")

    def state(self, drive: str, point: str) -> str:
        """Present value of a point."""
        return f"{self.site}/{drive}/state/{point}"

    def data(self, drive: str) -> str:
        """Values of a drive that were read together."""
        return f"{self.site}/{drive}/data"

    def event(self, drive: str) -> str:
        """Events of a drive; of the gateway itself when ``drive`` is empty."""
        return f"{self.site}/{drive or f'{RESERVED}/{self.gateway}'}/event"

    def meta(self, drive: str) -> str:
        """What a drive offers."""
        return f"{self.site}/{drive}/meta"

    def status(self, drive: str) -> str:
        """Whether a drive answers."""
        return f"{self.site}/{drive}/status"

    def ack(self, drive: str, name: str) -> str:
        """Answers to commands for ``name``."""
        return f"{self.site}/{drive}/ack/{name}"

    @property
    def gateway_status(self) -> str:
        """Birth and will of the gateway."""
        return f"{self.site}/{RESERVED}/{self.gateway}/status"

    @property
    def commands(self) -> str:
        """The filter that catches every command of the site, other gateways' drives included."""
        return f"{self.site}/+/cmd/#"

    def command(self, topic: str) -> tuple[str, str] | None:
        """Drive and name that a command topic addresses; None for any other topic."""
        site, _, rest = topic.partition("/")
        drive, _, rest = rest.partition("/")
        kind, _, name = rest.partition("/")
        return (drive, name) if site == self.site and kind == "cmd" and drive and name else None

    def foreign(self, topic: str) -> bool:
        """True when answers may be sent to ``topic`` because a client asks for it.

        Nothing inside the site's own tree (the gateway would lend its rights to forge a state, an answer
        or a command), no wildcards, nothing of the broker's.
        """
        own = topic == self.site or topic.startswith(f"{self.site}/")
        return bool(topic) and not own and not topic.startswith("$") and not set(topic) & set("+#\0")
