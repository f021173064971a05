"""Who is on a port."""
