"""For all tests."""

from __future__ import annotations

from hypothesis import settings

# how long an example takes says something of the machine, not of the property
settings.register_profile("gateway", deadline=None)
settings.load_profile("gateway")
