"""How fast frames are built, sought and decoded. Run: ``python -m benchmarks.codec``."""

from __future__ import annotations

import time
from collections.abc import Callable
from fractions import Fraction

from gateway.mapping.profile import Encoding
from gateway.modbus import encoding, pdu
from gateway.modbus.rtu import RtuFraming, crc

SECONDS = 0.5
"""How long each figure is measured."""

HZ = Encoding(scale=Fraction(1, 100), symbol="Hz")


def rate(work: Callable[[], object]) -> float:
    """Calls per second."""
    calls, start = 0, time.perf_counter()
    while (took := time.perf_counter() - start) < SECONDS:
        for _ in range(100):
            work()
        calls += 100
    return calls / took


def main() -> None:
    """Print one line per step of a 16-register read."""
    framing = RtuFraming()
    request = pdu.read_registers(0x20, 16)
    sent = framing.encode(5, request.pdu)
    body = bytes((5, 3, 32)) + bytes(range(32))
    reply = body + crc(body)
    steps: dict[str, Callable[[], object]] = {
        "request to frame": lambda: framing.encode(5, pdu.read_registers(0x20, 16).pdu),
        "reply of 16 registers sought": lambda: framing.seeker(sent, request).feed(reply),
        "value decoded": lambda: encoding.decode(HZ, (6000,)),
        "value encoded": lambda: encoding.encode(HZ, Fraction(60)),
    }
    for name, work in steps.items():
        print(f"{name:32} {1e6 / rate(work):8.1f} µs")


if __name__ == "__main__":
    main()
