"""The bridge API: the only thing northbound adapters know of the core."""
