"""Writes on a line that is full: how soon they are on the wire, and what they leave to the reads."""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

from benchmarks.limit.measure import distribution, use_from
from benchmarks.limit.product import Running

SETPOINT, COMMAND = 0x02, 0x01
"""Addresses of the frequency and of the run command."""
MEAN = 0.2
"""Seconds from an answer to the next ask, on average."""
P50, P99 = 20.0, 50.0
"""Milliseconds to reach."""
STREAM = 500
FLOOD = 1000

Row = dict[str, Any]


def measure_latency(gateway: Running, seconds: float) -> Row:
    """Asks at random times, from one client and then from the other: from the ask to the first bit on the
    wire."""
    number, drives = int(seconds / MEAN / 2), gateway.plant.all_drives
    gateway.wire.count()
    asked = {
        "opcua": gateway.opcua.ask(write={"drives": drives, "first": 1, "number": number, "mean": MEAN}),
        "mqtt": gateway.mqtt.ask(write={"drives": drives, "first": 2001, "number": number, "mean": MEAN}),
    }
    sent = _setpoints(gateway)
    row: Row = {
        "asks": number,
        "outcomes": dict(Counter(one["outcome"] for asks in asked.values() for one in asks)),
    }
    for name, asks in asked.items():
        row[name] = distribution([sent[one["raw"]] - one["at"] for one in asks if one["raw"] in sent])
    fast = all(row[name]["p50"] <= P50 and row[name]["p99"] <= P99 for name in asked)
    return {**row, "wanted": f"p50 {P50:g}, p99 {P99:g} ms", "reached": fast}


def measure_flood(gateway: Running, seconds: float) -> Row:
    """A thousand writes wait, and one drive is stopped: when the stop is on the wire."""
    drives = gateway.plant.all_drives
    gateway.wire.count()
    answer = gateway.opcua.ask(flood={"drives": drives, "number": FLOOD, "wait": 1.0})
    time.sleep(0.5)
    stops = [at for at, _, address, _ in _writes(gateway) if address == COMMAND and at >= answer["at"]]
    took = 1000 * (stops[0] - answer["at"]) if stops else float("inf")
    row = {"stop": round(took, 1), "outcome": answer["outcome"], "writes_waited": answer["waits"]}
    return {**row, "wanted": f"{P99:g} ms", "reached": took <= P99 and answer["waits"]}


def measure_stream(gateway: Running, seconds: float) -> Row:
    """Setpoints come faster than the line can carry them: how many are sent, and whether the last one is."""
    gateway.wire.count()
    drive = gateway.plant.all_drives[0]
    outcomes = Counter(gateway.opcua.ask(stream={"drive": drive, "first": 1, "number": STREAM}))
    sent = _setpoints(gateway)
    last = STREAM in sent
    row = {"asked": STREAM, "sent": len(sent), "outcomes": dict(outcomes), "last_sent": last}
    return {**row, "wanted": "the newest", "reached": last and len(sent) < STREAM / 4}


def measure_share(gateway: Running, seconds: float) -> Row:
    """As many writes as there can be: what share of the line is left to planned reads."""
    gateway.wire.count()
    gateway.opcua.tell(flood={"drives": gateway.plant.all_drives, "number": FLOOD, "wait": seconds})
    gateway.opcua.hear()
    used = use_from(gateway.plant, gateway.wire.tally())
    row = {"ratio": used.ratio, "violations": used.violations, "evenness": used.evenness}
    return {**row, "wanted": 0.49, "reached": used.ratio >= 0.49}


def _writes(gateway: Running) -> list[tuple[float, int, int, list[int]]]:
    return [tuple(write) for tally in gateway.wire.tally().values() for write in tally["writes"]]


def _setpoints(gateway: Running) -> dict[int, float]:
    """When the first bit of each setpoint was on the wire, by raw value."""
    return {words[0]: at for at, _, address, words in _writes(gateway) if address == SETPOINT}
