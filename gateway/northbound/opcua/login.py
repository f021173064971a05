"""Who is there: the user identity token of ActivateSession (OPC 10000-4 section 7.40) becomes a client."""

from __future__ import annotations

import asyncio
import hmac
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import structlog
from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto import uacrypto
from asyncua.crypto.permission_rules import User, UserRole

from gateway.northbound.opcua.request import ChannelView
from gateway.northbound.opcua.throttle import Throttle
from gateway.tag import Role
from gateway.users import UsersError, UsersFile

_log = structlog.get_logger(__name__)

# RSA with PKCS #1 v1.5 padding is left out: it lets an eavesdropper recover passwords step by step.
_DECRYPT: dict[str, Callable[[Any, bytes], bytes]] = {
    "http://www.w3.org/2001/04/xmlenc#rsa-oaep": uacrypto.decrypt_rsa_oaep,
    "http://opcfoundation.org/UA/security/rsa-oaep-sha2-256": uacrypto.decrypt_rsa_oaep_sha256,
}


@dataclass
class Client(User):
    """A client as asyncua knows it (an ordinary user, never its administrator), with its rights here."""

    role: UserRole = UserRole.User
    rights: Role = Role.VIEWER
    anonymous: bool = True


class Gate:
    """Lets clients in: anonymous ones for reading if that is allowed, the others by name and password."""

    def __init__(self, users: UsersFile | None, *, anonymous: bool) -> None:
        self._users = users
        self._anonymous = anonymous
        self._throttle = Throttle()
        self._one_hash = asyncio.Semaphore(1)  # each takes 32 MiB

    async def admit(self, token: Any, nonce: bytes, channel: ChannelView, key: Any) -> Client:
        """The client that the token tells of.

        Raises:
            ServiceError: BadIdentityTokenRejected, BadIdentityTokenInvalid or BadUserAccessDenied.
        """
        if _is_anonymous(token):
            if not self._anonymous:
                raise ServiceError(ua.StatusCodes.BadIdentityTokenRejected)
            return Client(name="anonymous")
        if not isinstance(token, ua.UserNameIdentityToken) or self._users is None:
            raise ServiceError(ua.StatusCodes.BadIdentityTokenRejected)
        name, password = _credentials(token, nonce, channel, key)
        role = await self._verify(self._users, name, password, channel.peer)
        return Client(name=name, rights=role, anonymous=False)

    async def _verify(self, users: UsersFile, name: str, password: str, source: str) -> Role:
        self._check_throttle(source)
        async with self._one_hash:
            self._check_throttle(source)
            try:
                role = await asyncio.to_thread(users.verify, name, password)
            except UsersError as error:
                _log.error("users file unusable", error=str(error))
                raise ServiceError(ua.StatusCodes.BadUserAccessDenied) from error
            if role is None:
                self._throttle.failed(source, time.monotonic())
                _log.warning("login refused", user=name, address=source)
                raise ServiceError(ua.StatusCodes.BadUserAccessDenied)
        self._throttle.succeeded(source)
        _log.info("login", user=name, role=role.value, address=source)
        return role

    def _check_throttle(self, source: str) -> None:
        wait = self._throttle.wait(source, time.monotonic())
        if wait > 0:
            _log.warning("login refused unread after wrong passwords", address=source, seconds=round(wait, 1))
            raise ServiceError(ua.StatusCodes.BadUserAccessDenied)


def _is_anonymous(token: Any) -> bool:
    # OPC 10000-4 section 5.7.3: a null token means anonymous.
    if isinstance(token, ua.ExtensionObject):
        return token.TypeId == ua.NodeId()
    return token is None or isinstance(token, ua.AnonymousIdentityToken)


def _credentials(
    token: ua.UserNameIdentityToken, nonce: bytes, channel: ChannelView, key: Any
) -> tuple[str, str]:
    try:
        return str(token.UserName or ""), _password(token, nonce, channel, key).decode()
    except ValueError as error:
        raise ServiceError(ua.StatusCodes.BadIdentityTokenInvalid) from error


def _password(token: ua.UserNameIdentityToken, nonce: bytes, channel: ChannelView, key: Any) -> bytes:
    if not token.EncryptionAlgorithm:
        if channel.mode is not ua.MessageSecurityMode.SignAndEncrypt:
            raise ServiceError(ua.StatusCodes.BadIdentityTokenRejected)
        return bytes(token.Password or b"")
    decrypt = _DECRYPT.get(str(token.EncryptionAlgorithm))
    if decrypt is None:
        raise ServiceError(ua.StatusCodes.BadIdentityTokenRejected)
    return _unwrap(decrypt(key, bytes(token.Password or b"")), nonce)


def _unwrap(secret: bytes, nonce: bytes) -> bytes:
    """The password out of length, password and nonce; the nonce proves that it is no replay."""
    length = int.from_bytes(secret[:4], "little")
    content = secret[4 : 4 + length]
    password, found = content[: len(content) - len(nonce)], content[len(content) - len(nonce) :]
    if len(content) != length or not hmac.compare_digest(found, nonce):
        raise ValueError("the encrypted password is not for this session")
    return password
