"""Modbus as bytes: values in registers, PDUs, framings and the time they take. All pure."""
