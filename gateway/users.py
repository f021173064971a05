"""The users file: who may log in, with what role, and a salted scrypt hash of the password.

JSON of mode 0600: ``{"users": {"anna": {"role": "operator", "password": "scrypt$15$8$1$salt$hash"}}}``.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import os
import secrets
import tempfile
from pathlib import Path

import msgspec

from gateway.tag import Role

COST = 15
"""Binary logarithm of scrypt's N: 32 MiB and some 100 ms for each guess."""
BLOCK_SIZE = 8
LONGEST_PASSWORD = 1024
_SALT_BYTES = 16


class UsersError(Exception):
    """The users file cannot be read, or a user cannot be added; says why and what to do."""


class _User(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    role: Role
    password: str


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    users: dict[str, _User]


class UsersFile:
    """The users file at ``path``, read anew for each question, so that changes count at once."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def verify(self, name: str, password: str) -> Role | None:
        """The role of the user, or None for a wrong name or password. Takes some 100 ms in either case.

        Raises:
            UsersError: if the file is damaged. A missing file has no users.
        """
        user = _load(self._path).get(name)
        expected = user.password if user is not None else _NOBODY
        right = len(password) <= LONGEST_PASSWORD and _matches(password, expected)
        return user.role if user is not None and right else None


def add_user(path: Path, name: str, role: Role, password: str) -> None:
    """Add a user, or give an existing one a new role and password.

    Raises:
        UsersError: if name or password is empty or the password too long, or the file is damaged.
    """
    if not name or not name.isprintable():
        raise UsersError("a user needs a printable name")
    if not 0 < len(password) <= LONGEST_PASSWORD:
        raise UsersError(f"a password has 1 to {LONGEST_PASSWORD} characters")
    users = _load(path)
    users[name] = _User(role=role, password=_hash(password))
    _store(path, users)


def remove_user(path: Path, name: str) -> bool:
    """Remove a user; False if there is none of that name.

    Raises:
        UsersError: if the file is damaged.
    """
    users = _load(path)
    if users.pop(name, None) is None:
        return False
    _store(path, users)
    return True


def roles(path: Path) -> dict[str, Role]:
    """The users and their roles, by name.

    Raises:
        UsersError: if the file is damaged. A missing file has no users.
    """
    return {name: user.role for name, user in sorted(_load(path).items())}


def _load(path: Path) -> dict[str, _User]:
    try:
        return dict(msgspec.json.decode(path.read_bytes(), type=_File).users)
    except FileNotFoundError:
        return {}
    except (OSError, msgspec.DecodeError) as error:
        raise UsersError(f"{path}: {error} (restore it, or remove it and add the users anew)") from error


def _store(path: Path, users: dict[str, _User]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    # mkstemp makes the file with mode 0600; the rename keeps a reader from ever seeing half of it.
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    with os.fdopen(handle, "wb") as file:
        file.write(msgspec.json.format(msgspec.json.encode(_File(users=users)), indent=2) + b"\n")
        file.flush()
        os.fsync(file.fileno())
    Path(draft).replace(path)


def _hash(password: str) -> str:
    salt = secrets.token_bytes(_SALT_BYTES)
    digest = _scrypt(password, salt, COST, BLOCK_SIZE, 1)
    return f"scrypt${COST}${BLOCK_SIZE}$1${_text(salt)}${_text(digest)}"


def _matches(password: str, expected: str) -> bool:
    try:
        _, cost, block_size, parallel, salt, digest = expected.split("$")
        found = _scrypt(password, base64.b64decode(salt), int(cost), int(block_size), int(parallel))
        return hmac.compare_digest(found, base64.b64decode(digest))
    except ValueError as error:
        raise UsersError(f"a password hash is damaged: {error} (add the user anew)") from error


def _scrypt(password: str, salt: bytes, cost: int, block_size: int, parallel: int) -> bytes:
    memory = 129 * block_size * parallel * 2**cost
    return hashlib.scrypt(
        password.encode(), salt=salt, n=2**cost, r=block_size, p=parallel, maxmem=memory, dklen=32
    )


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


# Verified against when the name is unknown, so that the time taken does not tell which names exist.
_NOBODY = f"scrypt${COST}${BLOCK_SIZE}$1${_text(bytes(_SALT_BYTES))}${_text(bytes(32))}"
