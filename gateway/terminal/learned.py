"""What a gateway found out about the drives of a site, from the journal in its data folder."""

from __future__ import annotations

import contextlib

from gateway.core.disk import Folder
from gateway.core.gaps import Gaps
from gateway.core.ledger import find
from gateway.mapping.site import Site


def learned_gaps(site: Site) -> Gaps:
    """The gaps across which drives do not let themselves be read; none where the journal cannot be read."""
    with contextlib.suppress(OSError):
        return find(Folder(site.data)).memory.gaps
    return Gaps()
