"""The OPC UA adapter on asyncua 2.1: `server` is where to begin."""
