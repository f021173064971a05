"""Simulated drives on simulated lines, for the demo, for tests, and for a SCADA that comes before its panel.

The drives, the wire and their faults are pure models in time; `live` runs them on a pty.
"""

from gateway.simulator.bank import UnsupportedError
from gateway.simulator.faults import CorruptByte, DelayReply, DropReply, NoiseBefore
from gateway.simulator.happening import Cured, Options, Panel, PanelSets, PowerCycle, Trip
from gateway.simulator.live import SimulatedLine
from gateway.simulator.site import run

__all__ = [
    "CorruptByte",
    "Cured",
    "DelayReply",
    "DropReply",
    "NoiseBefore",
    "Options",
    "Panel",
    "PanelSets",
    "PowerCycle",
    "SimulatedLine",
    "Trip",
    "UnsupportedError",
    "run",
]
