"""An MQTT client in a process of its own: counts what is published, and writes at random times."""

from __future__ import annotations

import asyncio
import json
import time
from dataclasses import asdict
from typing import Any

from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion

from benchmarks.limit.asks import ask_at_random
from benchmarks.limit.talk import asked, say, settings

ANSWER_SECONDS = 10.0
MEANT_SECONDS = 5.0


class Spy:
    """Sees everything below the site's topic, and waits for answers."""

    def __init__(self, site: str, port: int) -> None:
        self.messages = 0
        self._site = site
        self._loop = asyncio.get_running_loop()
        self._waiting: dict[int, asyncio.Future[str]] = {}
        self._subscribed = asyncio.Event()
        self._client = Client(CallbackAPIVersion.VERSION2)
        self._client.on_message = self._arrived
        self._client.on_subscribe = self._is_subscribed
        self._client.on_connect = lambda client, *_: client.subscribe(f"{site}/#", qos=0)
        self._client.connect("127.0.0.1", port)
        self._client.loop_start()

    async def ready(self) -> None:
        """Wait until messages come."""
        await self._subscribed.wait()

    async def setpoint(self, drive: str, value: float) -> str:
        """Write a frequency; the verdict."""
        number = round(value * 100)
        future = self._waiting[number] = self._loop.create_future()
        command = {"id": number, "v": value, "exp": time.time() + MEANT_SECONDS}
        self._client.publish(f"{self._site}/{drive}/cmd/frequency_command", json.dumps(command), qos=1)
        try:
            return await asyncio.wait_for(future, ANSWER_SECONDS)
        except TimeoutError:
            return "timeout"

    def _is_subscribed(self, *_: Any) -> None:
        self._loop.call_soon_threadsafe(self._subscribed.set)

    def _arrived(self, client: Client, data: Any, message: MQTTMessage) -> None:
        self.messages += 1
        if "/ack/" in message.topic:
            answer = json.loads(message.payload)
            self._loop.call_soon_threadsafe(self._answered, answer["id"], answer["verdict"])

    def _answered(self, number: int, verdict: str) -> None:
        future = self._waiting.pop(number, None)
        if future is not None and not future.done():
            future.set_result(verdict)


async def main() -> None:
    """Subscribe, and do what standard input asks."""
    given = settings()
    spy = Spy(given["site"], given["port"])
    await spy.ready()
    say({"ready": True})
    async for what in asked():
        if "write" in what:
            say([asdict(ask) for ask in await ask_at_random(spy.setpoint, **what["write"])])
        else:
            say({"messages": spy.messages})


if __name__ == "__main__":
    asyncio.run(main())
