"""Every frame printed in the drives' documents, in wire order, errata corrected and named."""

from typing import NamedTuple


class Exchange(NamedTuple):
    """A request and the reply that the document prints for it."""

    name: str
    request: str
    reply: str


TECO_7200GS = [
    Exchange("8.1 read, normal", "05 03 00 01 00 01 D4 4E", "05 03 02 00 01 88 44"),
    Exchange("8.1 read, error", "05 03 00 01 00 01 D4 4E", "05 83 01 C1 31"),
    Exchange("8.2 write, normal", "05 10 00 01 00 01 02 00 01 54 81", "05 10 00 01 00 01 51 8D"),
    Exchange("8.2 write, error", "05 10 00 01 00 01 02 00 01 54 81", "05 90 06 8D C3"),
    Exchange("11 step 1", "05 10 00 01 00 02 04 00 01 17 70 78 87", "05 10 00 01 00 02 11 8C"),
    Exchange("11 step 2", "05 10 00 01 00 02 04 00 01 0B B8 71 D1", "05 10 00 01 00 02 11 8C"),
    Exchange("11 step 3", "05 10 00 01 00 02 04 00 03 0B B8 D0 11", "05 10 00 01 00 02 11 8C"),
    Exchange("11 step 4", "05 10 00 01 00 01 02 00 00 95 41", "05 10 00 01 00 01 51 8D"),
]

S2000 = [
    Exchange("6 read", "02 03 01 00 00 04 45 C6", "02 03 08 00 01 00 02 00 00 00 00 F3 93"),
    Exchange("6 read, error", "02 03 01 00 00 04 45 C6", "02 83 03 F1 31"),
    Exchange("7 write", "01 10 02 80 00 02 04 02 58 01 F4 62 D3", "01 10 02 80 00 02 41 98"),
    Exchange("7 write, error", "01 10 02 80 00 02 04 02 58 01 F4 62 D3", "01 90 02 CD C1"),
    Exchange("9 loop-back", "01 08 00 00 A5 37 DA 8D", "01 08 00 00 A5 37 DA 8D"),
]

SL3 = [
    Exchange("example 1", "01 06 10 00 00 00 8D 0A", "01 06 10 00 00 00 8D 0A"),
    Exchange("example 2", "01 03 00 A2 00 01 25 E8", "01 03 02 FF FF B9 F4"),
]

SL3_ASCII = [
    Exchange(
        "example 1",
        "3A 30 31 30 36 31 30 30 30 30 30 30 30 45 39 0D 0A",
        "3A 30 31 30 36 31 30 30 30 30 30 30 30 45 39 0D 0A",
    ),
    Exchange(
        "example 2",
        "3A 30 31 30 33 30 30 41 32 30 30 30 31 35 39 0D 0A",
        "3A 30 31 30 33 30 32 46 46 46 46 46 43 0D 0A",
    ),
]


class Erratum(NamedTuple):
    """A printed frame whose check bytes are wrong, and the right ones."""

    name: str
    body: str
    printed: str
    right: str


S2000_ERRATA = [
    Erratum("8 ENTER to EEPROM", "01 10 FF FD 00 01 02 00 00", "BB D2", "BC B2"),
    Erratum("8 ENTER to RAM", "01 10 FF DD 00 01 02 00 00", "38 BA", "BB D2"),
    Erratum("9 loop-back error", "01 88 01", "86 50", "87 C0"),
]
