"""A gateway between variable-frequency drives on RS-485 and OPC UA and MQTT."""

__version__ = "0.1.0"
