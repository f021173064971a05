"""Stands in for a simulator: makes the link after a moment and stays. Usage: fake_simulator.py LINK."""

import signal
import sys
from pathlib import Path

Path(sys.argv[1]).symlink_to("/dev/null")
signal.pause()
