"""The adapter's section of the site file, as far as the connection is concerned."""

from __future__ import annotations

import stat
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from gateway.tag import Role

PORTS = {"mqtt": 1883, "mqtts": 8883, "ws": 80, "wss": 443}
"""Schemes of a broker's address and their standard ports."""


class SettingsError(ValueError):
    """The section cannot be used as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Broker:
    """Where the broker is and who we are to it."""

    scheme: str
    host: str
    port: int
    path: str
    client_id: str
    user: str | None = None
    password_file: Path | None = None
    ca_file: Path | None = None

    @property
    def tls(self) -> bool:
        """True when the connection is encrypted and the broker's certificate checked."""
        return self.scheme in ("mqtts", "wss")

    @property
    def websocket(self) -> bool:
        """True for MQTT inside a websocket."""
        return self.scheme in ("ws", "wss")

    @property
    def address(self) -> str:
        """The broker's address, for people and for the journal."""
        return f"{self.scheme}://{self.host}:{self.port}"

    def password(self) -> str | None:
        """The password, read anew each time so that it can be changed without a restart.

        Raises:
            SettingsError: if everybody on this machine may read the file.
            OSError: if it cannot be read.
        """
        if self.password_file is None:
            return None
        if stat.S_IMODE(self.password_file.stat().st_mode) & stat.S_IROTH:
            raise SettingsError(f"{self.password_file} can be read by everybody (chmod o-r it)")
        return self.password_file.read_text(encoding="utf-8").rstrip("\r\n")


@dataclass(frozen=True, slots=True)
class Settings:
    """One MQTT section: the broker, the role of those who command through it (None: no commands), and
    the publish rules (None: the default)."""

    broker: Broker
    role: Role | None
    publish: list[Mapping[str, Any]] | None


def settings_of(section: Mapping[str, Any]) -> Settings:
    """Read the section that the core hands to this adapter.

    Raises:
        SettingsError: if the broker's address is not one.
    """
    commands = section.get("commands")
    role = Role(commands["role"]) if commands else None
    return Settings(_broker(section), role, section.get("publish"))


def _broker(section: Mapping[str, Any]) -> Broker:
    text = section["broker"]
    try:
        url = urlsplit(text)
        port = url.port
    except ValueError as error:
        raise SettingsError(f"broker {text!r}: {error}") from None
    if url.scheme not in PORTS or not url.hostname:
        raise SettingsError(f"broker {text!r} is not mqtt://, mqtts://, ws:// or wss:// with a host")
    if url.username is not None or url.password is not None:
        raise SettingsError("broker: no user or password in the address (use user: and password_file:)")
    return Broker(
        scheme=url.scheme,
        host=url.hostname,
        port=PORTS[url.scheme] if port is None else port,
        path=url.path or "/mqtt",
        client_id=section["client_id"],
        user=section.get("user"),
        password_file=_path(section.get("password_file")),
        ca_file=_path(section.get("ca_file")),
    )


def _path(text: str | None) -> Path | None:
    return Path(text) if text else None
