"""A blocking call in a thread that nobody has to wait for.

The event loop's own executor is joined when the process ends; a connection attempt to a broker that does
not answer would hold up the end for seconds.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable


async def in_thread(call: Callable[[], object], abandoned: Callable[[], object]) -> None:
    """Run ``call`` in a daemon thread and wait for its end; its exceptions come out here.

    If the waiting is cancelled, the thread goes on alone and calls ``abandoned`` once ``call`` is done.
    """
    loop = asyncio.get_running_loop()
    done: asyncio.Future[None] = loop.create_future()
    given_up = threading.Event()

    def finish(error: Exception | None) -> None:
        if done.done():
            return
        if error is None:
            done.set_result(None)
        else:
            done.set_exception(error)

    def work() -> None:
        error: Exception | None = None
        try:
            call()
        except Exception as raised:
            error = raised
        if given_up.is_set():
            abandoned()
            return
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody waits any more
            loop.call_soon_threadsafe(finish, error)

    threading.Thread(target=work, name="mqtt-connect", daemon=True).start()
    try:
        await done
    except asyncio.CancelledError:
        given_up.set()
        raise
