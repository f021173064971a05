"""Every kind of entry that the core makes can be told to people, and filtered."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.terminal.auditing import Wanted, entry_line, entry_object

BY = {"through": "opcua", "who": "anna", "role": "operator", "address": "10.0.0.7:4711"}
STAMPS: dict[str, Any] = {"hash": "0" * 64, "n": 1, "time": 10**18, "mono": 1.0, "lived": 1.0, "boot": "b"}
REFUSED = {"verdict": "refused", "cause": "lease", "reason": "bert has the lease"}
ALARM = {"key": "fan-1.restarted", "subject": "fan-1", "name": "restarted", "text": "fan-1 restarted"}


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (
            {"kind": "lease", "drive": "fan-1", "did": "acquired", "by": BY, "reason": "", "due": ""},
            "lease of fan-1 acquired by anna (opcua, 10.0.0.7:4711)",
        ),
        (
            {"kind": "lease", "drive": "fan-1", "did": "expired", "by": None, "reason": "", "due": "stop"},
            "lease of fan-1 expired; due now: stop",
        ),
        (
            {"kind": "lease_asked", "what": "fan-1.acquire", "by": BY, "outcome": REFUSED},
            "lease fan-1.acquire by anna (opcua, 10.0.0.7:4711): refused: bert has the lease",
        ),
        (
            {"kind": "maintenance", "drive": "fan-1", "on": True, "by": BY, "words": "..."},
            "maintenance of fan-1 on by anna (opcua, 10.0.0.7:4711)",
        ),
        (
            {"kind": "alarm", "did": "raised", "alarm": ALARM},
            "alarm raised: fan-1.restarted: fan-1 restarted",
        ),
        (
            {
                "kind": "turned away",
                "what": "fan-1.stop",
                "wanted": None,
                "by": BY,
                "outcome": REFUSED,
                "passed_over": 7,
            },
            "fan-1.stop = ? by anna (opcua, 10.0.0.7:4711): turned away: bert has the lease "
            "(7 more before it)",
        ),
        ({"kind": "unsent", "ask": 7, "frame": 2}, "#7: frame 2 was not sent after all"),
        (
            {"kind": "spared", "ask": 7, "frame": 2, "drive": "fan-1", "wears": ["0103H"]},
            "#7: frame 2 wore nothing",
        ),
        ({"kind": "clock", "jump": -90.0, "before": 1}, "the clock was set back by 90 s"),
        ({"kind": "lost", "entries": 12}, "12 entries were lost while the disk failed"),
        ({"kind": "something new", "drive": "fan-1", "a": 1}, "something new drive=fan-1 a=1"),
    ],
)
def test_in_words(entry: dict[str, Any], words: str) -> None:
    assert entry_line(STAMPS | entry).split("  ", 1)[1] == words
    assert entry_object(STAMPS | entry, "journal-000000000001.jsonl:1")["kind"] == entry["kind"]
    about = {"unsent", "clock", "lost"}
    assert Wanted(drive="fan-1").takes(STAMPS | entry) is (entry["kind"] not in about)
    assert Wanted(who="bert").takes(STAMPS | entry) is False
    assert Wanted(outcome="confirmed").takes(STAMPS | entry) is False
