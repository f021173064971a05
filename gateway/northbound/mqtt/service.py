"""The adapter: one broker, one bridge, until told to stop or the bridge closes."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator

from gateway.bridge.api import Bridge, BridgeError, Replaced, Update
from gateway.northbound.mqtt import payload
from gateway.northbound.mqtt.commander import Commander
from gateway.northbound.mqtt.intake import Intake
from gateway.northbound.mqtt.link import Link
from gateway.northbound.mqtt.outbox import Outbox
from gateway.northbound.mqtt.publisher import Publisher
from gateway.northbound.mqtt.rules import rules_for
from gateway.northbound.mqtt.runner import Runner
from gateway.northbound.mqtt.settings import settings_of
from gateway.northbound.mqtt.topics import Topics
from gateway.tag import Instant

FINISH_COMMANDS = 0.5
"""Seconds that commands under way have to get their answer when the adapter stops."""
FINISH_MESSAGES = 0.5
"""Seconds for the last messages after that."""

log = logging.getLogger(__name__)


def clock() -> Instant:
    """Now, on both clocks."""
    return Instant(time.monotonic(), time.time_ns())


async def serve(bridge: Bridge, stop: asyncio.Event) -> None:
    """Show the bridge's tags on the broker of its section, until ``stop`` is set.

    Raises:
        BridgeError: if the bridge closes before that.
        SettingsError, TopicError: if the section or a name in the catalogue cannot be used.
    """
    updates = bridge.updates()
    outbox = Outbox()
    while not stop.is_set():
        await Generation(bridge, outbox).run(updates, stop)


class Generation:
    """The adapter under one configuration. What is retained at the broker outlives it in the outbox."""

    def __init__(self, bridge: Bridge, outbox: Outbox) -> None:
        catalogue = bridge.catalogue
        settings = settings_of(bridge.section)
        others = (*catalogue.lines, *catalogue.own)
        topics = Topics(catalogue.site, catalogue.gateway, catalogue.drives, others)
        self._bridge = bridge
        self._outbox = outbox
        self._topics = topics
        self._rules = rules_for(settings.publish, catalogue)
        self._publisher = Publisher(topics, catalogue, self._rules, outbox)
        self._runner: Runner | None = None
        self._commander: Commander | None = None
        if settings.role is not None:
            self._runner = Runner(bridge, settings.role, settings.broker.address)
            self._commander = Commander(topics, catalogue.owners, self._runner, outbox, clock)
        commander = self._commander
        receive = Intake(commander.receive, commander.urgent).put if commander else None
        self._link = Link(settings.broker, topics, outbox, catalogue.version, receive)

    async def run(self, updates: AsyncIterator[Update], stop: asyncio.Event) -> None:
        """Serve until ``stop``, or until a new configuration is in force.

        Raises:
            BridgeError: if the bridge closes.
        """
        self._publisher.announce(clock())
        reason = "the gateway's core is gone"
        link = asyncio.create_task(self._link.run())
        try:
            await self._demand()
            await self._until(stop, updates, link)
            reason = "the gateway is being stopped" if stop.is_set() else ""
        finally:
            await self._end(reason)
            link.cancel()
            await asyncio.wait((link,))

    async def _demand(self) -> None:
        promised = await self._bridge.watch({tag: rule.rate for tag, rule in self._rules.items()})
        if missing := sorted(self._rules.keys() - promised.keys()):
            log.warning("these tags cannot be read: %s", ", ".join(missing))

    async def _until(
        self, stop: asyncio.Event, updates: AsyncIterator[Update], link: asyncio.Task[None]
    ) -> None:
        follow = asyncio.create_task(self._follow(updates))
        stopping = asyncio.create_task(stop.wait())
        try:
            done, _ = await asyncio.wait((follow, stopping, link), return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            follow.cancel()
            stopping.cancel()
            await asyncio.wait((follow, stopping))

    async def _follow(self, updates: AsyncIterator[Update]) -> None:
        """Publish what happens, until a new configuration takes the place of this one."""
        async for update in updates:
            if isinstance(update, Replaced):
                await self._bridge.watch(dict.fromkeys(self._rules))
                return
            self._publisher.update(update, time.monotonic())
        raise BridgeError("the bridge is closed")

    async def _end(self, reason: str) -> None:
        """Leave the broker with the truth. An empty ``reason``: another generation follows at once."""
        if self._commander is not None and self._runner is not None:
            self._commander.closing = True
            await self._runner.finish(FINISH_COMMANDS)
        now = time.time_ns()
        if reason:
            self._publisher.lost(reason, now)
        last_word = payload.offline(reason or "new configuration", now)
        self._outbox.retain(self._topics.gateway_status, last_word)
        await self._link.drain(FINISH_MESSAGES)
