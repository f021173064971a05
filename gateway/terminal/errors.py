"""Errors that people see: one line, no traceback."""

from __future__ import annotations


class CommandError(Exception):
    """The command could not do what it was asked. The message is for people."""

    exit_code = 1
    prefix = "error: "


class UsageError(CommandError):
    """The command line itself is wrong."""

    exit_code = 2
