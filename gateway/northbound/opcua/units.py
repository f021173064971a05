"""Engineering units as OPC 10000-8 section 5.6.4 wants them: UNECE Recommendation 20 common codes."""

from __future__ import annotations

from asyncua import ua

UNECE_NAMESPACE = "http://www.opcfoundation.org/UA/units/un/cefact"

_CODES: dict[str, tuple[str, str]] = {
    "%": ("P1", "percent"),
    "A": ("AMP", "ampere"),
    "mA": ("4K", "milliampere"),
    "V": ("VLT", "volt"),
    "mV": ("2Z", "millivolt"),
    "kV": ("KVT", "kilovolt"),
    "W": ("WTT", "watt"),
    "kW": ("KWT", "kilowatt"),
    "MW": ("MAW", "megawatt"),
    "VA": ("D46", "volt - ampere"),
    "kVA": ("KVA", "kilovolt - ampere"),
    "var": ("D44", "var"),
    "kvar": ("KVR", "kilovar"),
    "Wh": ("WHR", "watt hour"),
    "kWh": ("KWH", "kilowatt hour"),
    "MWh": ("MWH", "megawatt hour"),
    "Hz": ("HTZ", "hertz"),
    "kHz": ("KHZ", "kilohertz"),
    "r/min": ("RPM", "revolutions per minute"),
    "rpm": ("RPM", "revolutions per minute"),
    "m/s": ("MTS", "metre per second"),
    "m/min": ("2X", "metre per minute"),
    "us": ("B98", "microsecond"),
    "µs": ("B98", "microsecond"),
    "ms": ("C26", "millisecond"),
    "s": ("SEC", "second [unit of time]"),
    "min": ("MIN", "minute [unit of time]"),
    "h": ("HUR", "hour"),
    "d": ("DAY", "day"),
    "°C": ("CEL", "degree Celsius"),
    "°F": ("FAH", "degree Fahrenheit"),
    "K": ("KEL", "kelvin"),
    "°": ("DD", "degree [unit of angle]"),
    "Ω": ("OHM", "ohm"),
    "ohm": ("OHM", "ohm"),
    "mΩ": ("E45", "milliohm"),
    "kΩ": ("B49", "kiloohm"),
    "mH": ("C14", "millihenry"),
    "Nm": ("NU", "newton metre"),
    "N·m": ("NU", "newton metre"),
    "N": ("NEW", "newton"),
    "Pa": ("PAL", "pascal"),
    "kPa": ("KPA", "kilopascal"),
    "bar": ("BAR", "bar [unit of pressure]"),
    "m": ("MTR", "metre"),
    "mm": ("MMT", "millimetre"),
    "kg": ("KGM", "kilogram"),
    "kgm²": ("B32", "kilogram metre squared"),
}


def engineering_units(symbol: str) -> ua.EUInformation:
    """The EUInformation of a unit's symbol. A unit without a common code has UnitId -1 and its symbol."""
    code, name = _CODES.get(symbol, ("", symbol))
    return ua.EUInformation(
        NamespaceUri=UNECE_NAMESPACE if code else "urn:gateway:units",
        UnitId=unit_id(code) if code else -1,
        DisplayName=ua.LocalizedText(symbol),
        Description=ua.LocalizedText(name),
    )


def unit_id(code: str) -> int:
    """The characters of a common code as one number: ``HTZ`` is 4740186."""
    return int.from_bytes(code.encode("ascii"), "big")
