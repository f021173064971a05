"""The users file."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from gateway.tag import Role
from gateway.users import UsersError, UsersFile, add_user


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "users.json"
    add_user(path, "anna", Role.OPERATOR, "secret")
    return path


def test_the_right_password_gives_the_role(path: Path) -> None:
    assert UsersFile(path).verify("anna", "secret") is Role.OPERATOR


@pytest.mark.parametrize(
    ("name", "password"),
    [("anna", "Secret"), ("anna", ""), ("bert", "secret"), ("", ""), ("anna", "x" * 5000)],
)
def test_anything_else_gives_nothing(path: Path, name: str, password: str) -> None:
    assert UsersFile(path).verify(name, password) is None


def test_without_a_file_nobody_is_known(tmp_path: Path) -> None:
    assert UsersFile(tmp_path / "none.json").verify("anna", "secret") is None


def test_a_user_can_be_given_another_password_and_role(path: Path) -> None:
    users = UsersFile(path)
    add_user(path, "bert", Role.VIEWER, "b")
    add_user(path, "anna", Role.ENGINEER, "other")
    assert users.verify("anna", "secret") is None
    assert users.verify("anna", "other") is Role.ENGINEER
    assert users.verify("bert", "b") is Role.VIEWER


def test_i1_the_file_is_private_and_holds_no_password(path: Path) -> None:
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert "secret" not in path.read_text()


@pytest.mark.parametrize("text", ["", "{", '{"users": {"anna": {"role": "king", "password": "x"}}}', "[]"])
def test_a_damaged_file_is_an_error(path: Path, text: str) -> None:
    path.write_text(text)
    with pytest.raises(UsersError, match=r"users\.json"):
        UsersFile(path).verify("anna", "secret")


def test_a_damaged_hash_is_an_error(path: Path) -> None:
    path.write_text('{"users": {"anna": {"role": "operator", "password": "scrypt$what"}}}')
    with pytest.raises(UsersError, match="damaged"):
        UsersFile(path).verify("anna", "secret")


@pytest.mark.parametrize(("name", "password"), [("", "x"), ("a\nb", "x"), ("anna", ""), ("anna", "x" * 1025)])
def test_careless_users_are_not_added(path: Path, name: str, password: str) -> None:
    with pytest.raises(UsersError):
        add_user(path, name, Role.VIEWER, password)
