"""The entrance: ``gateway``, or ``python -m gateway``."""

from __future__ import annotations

import os
import sys

from gateway.terminal.errors import CommandError

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells expect it."""


def main() -> None:
    """Run the command line. People see one line for an error, never a traceback, unless they ask for it
    with ``GATEWAY_DEBUG=1``."""
    from gateway.cli import app

    try:
        app()
    except CommandError as error:
        _end(f"{error.prefix}{error}", error.exit_code)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except Exception as error:
        if os.environ.get("GATEWAY_DEBUG"):
            raise
        _end(f"internal error: {type(error).__name__}: {error} (GATEWAY_DEBUG=1 shows where)", 1)


def _end(message: str, code: int) -> None:
    sys.stderr.write(message + "\n")
    sys.exit(code)


if __name__ == "__main__":
    main()
