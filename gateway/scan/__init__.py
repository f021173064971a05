"""Who is on a port, and how it is set: what to ask in which order, and what the answers speak for.

Nothing but reads and loop-backs are ever sent. Everything is pure but `asker`, which has the port.
"""
