"""A pseudo terminal that stands for the serial port of a line."""

from __future__ import annotations

import os
import termios
import tty
from contextlib import suppress
from pathlib import Path

READ_SIZE = 4096
_IN_SPEED, _OUT_SPEED = 4, 5
"""Places in what `termios.tcgetattr` returns."""


class Pty:
    """A raw pty under a stable name: ``link`` is a symbolic link to the side that the master opens. It is
    set to ``baud`` until a master sets it otherwise."""

    def __init__(self, link: Path, baud: int) -> None:
        if link.exists() and not link.is_symlink():
            raise FileExistsError(f"{link} is there already and is no symbolic link")
        link.parent.mkdir(parents=True, exist_ok=True)
        self.link = link
        self.fd, self._other = os.openpty()
        tty.setraw(self._other)
        self._speed = getattr(termios, f"B{baud}", None)
        self._set_speed()
        os.set_blocking(self.fd, False)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._other))

    @property
    def at_speed(self) -> bool:
        """True while the master's side is set to the line's speed, as far as that can be told. Parity and
        data bits are not kept by a pty."""
        return self._speed is None or termios.tcgetattr(self.fd)[_OUT_SPEED] == self._speed

    def _set_speed(self) -> None:
        if self._speed is not None:
            settings = termios.tcgetattr(self._other)
            settings[_IN_SPEED] = settings[_OUT_SPEED] = self._speed
            termios.tcsetattr(self._other, termios.TCSANOW, settings)

    def read(self) -> bytes:
        """What the master has written; empty when nothing is there."""
        try:
            return os.read(self.fd, READ_SIZE)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Hand bytes to the master. What does not fit is lost, as it is in a UART that nobody reads."""
        with suppress(BlockingIOError):
            os.write(self.fd, data)

    def close(self) -> None:
        """Hang up; whoever has the port open gets an error, as when an adapter is pulled out."""
        self.link.unlink(missing_ok=True)
        os.close(self.fd)
        os.close(self._other)
