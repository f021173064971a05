"""The site file's ``opcua`` section, checked once more at the place where it counts."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

DEFAULT_PORT = 4840


class Security(StrEnum):
    """How a client may protect its channel."""

    NONE = "none"
    SIGN = "sign"
    SIGN_AND_ENCRYPT = "sign_and_encrypt"


class SettingsError(Exception):
    """The section cannot be used; says why and what to write instead."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Where to listen, and who may come in how."""

    host: str
    port: int
    security: tuple[Security, ...] = (Security.SIGN_AND_ENCRYPT,)
    anonymous: bool = False
    """Read without a user name. Nobody writes without one."""
    users_file: Path | None = None
    certificates: Path
    """Folder with ``own``, ``trusted`` and ``rejected``."""

    @property
    def url(self) -> str:
        """The endpoint as clients write it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"opc.tcp://{host}:{self.port}"


def read_settings(section: Mapping[str, Any]) -> Settings:
    """The settings in a section.

    Raises:
        SettingsError: if a value is missing or wrong, or if the endpoint is open to the network while
            channels without protection or clients without a name are let in.
    """
    host, port = _endpoint(section.get("endpoint"))
    users_file = section.get("users_file")
    certificates = section.get("certificates")
    if not certificates:
        raise SettingsError("opcua.certificates is missing (name a folder)")
    settings = Settings(
        host=host,
        port=port,
        security=_security(section.get("security", (Security.SIGN_AND_ENCRYPT,))),
        anonymous=section.get("anonymous", False) is True,
        users_file=Path(users_file) if users_file else None,
        certificates=Path(certificates),
    )
    _refuse_careless(settings)
    return settings


def _endpoint(text: object) -> tuple[str, int]:
    if not isinstance(text, str):
        raise SettingsError("opcua.endpoint is missing (write opc.tcp://127.0.0.1:4840)")
    try:
        parts = urlsplit(text)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise SettingsError(f"opcua.endpoint {text!r}: {error}") from error
    if parts.scheme != "opc.tcp" or not host:
        raise SettingsError(f"opcua.endpoint {text!r} is not of the form opc.tcp://host:port")
    return host, DEFAULT_PORT if port is None else port


def _security(names: Sequence[str]) -> tuple[Security, ...]:
    try:
        chosen = tuple(Security(name) for name in names)
    except ValueError as error:
        raise SettingsError(f"opcua.security: {error} (none, sign or sign_and_encrypt)") from error
    if not chosen:
        raise SettingsError("opcua.security is empty, so nobody could connect (write [sign_and_encrypt])")
    return chosen


def _refuse_careless(settings: Settings) -> None:
    if is_loopback(settings.host):
        return
    if settings.anonymous:
        raise SettingsError("opcua.anonymous is only for an endpoint on 127.0.0.1")
    if Security.NONE in settings.security:
        raise SettingsError("opcua.security: none is only for an endpoint on 127.0.0.1")


def is_loopback(host: str) -> bool:
    """True when only programs on this machine can reach the host address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
