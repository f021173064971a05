"""Which names can be levels of a topic on every broker."""

from __future__ import annotations


class TopicError(ValueError):
    """A name that cannot stand in a topic, or topics that would mean two things."""


def check_level(name: str) -> str:
    """Give ``name`` back if it can be one level of a topic on every broker, else raise `TopicError`."""
    if not name or any(c in "/+#" or c.isspace() or not c.isprintable() for c in name):
        raise TopicError(f"{name!r} cannot be part of an MQTT topic: no /, +, # or spaces (rename it)")
    return name


def check_levels(text: str) -> str:
    """As `check_level`, for one or more levels with slashes between them."""
    for level in text.split("/"):
        try:
            check_level(level)
        except TopicError as error:
            raise TopicError(f"topic {text!r}: {error}") from None
    return text


def is_below(topic: str, tree: str) -> bool:
    """True when the topic is ``tree`` itself or lies below it."""
    return topic == tree or topic.startswith(f"{tree}/")
