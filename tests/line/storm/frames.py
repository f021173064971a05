"""Frames as the standard tells them."""

from __future__ import annotations

READ, WRITE_ONE, LOOP_BACK, WRITE_MANY = 3, 6, 8, 16


def _table() -> list[int]:
    table = []
    for byte in range(256):
        register = byte
        for _ in range(8):
            register = register >> 1 ^ (0xA001 if register & 1 else 0)
        table.append(register)
    return table


_TABLE = _table()


def check(data: bytes) -> bytes:
    """The CRC in the order of the wire."""
    register = 0xFFFF
    for byte in data:
        register = register >> 8 ^ _TABLE[(register ^ byte) & 0xFF]
    return bytes((register & 0xFF, register >> 8))


class Rtu:
    """Unit, PDU, CRC."""

    def pack(self, content: bytes, like: bytes = b"") -> bytes:
        return content + check(content)

    def unpack(self, data: bytes) -> bytes | None:
        good = len(data) > 3 and check(data[:-2]) == data[-2:]
        return data[:-2] if good else None


class Ascii:
    """Colon, hexadecimal digits, LRC, CR LF."""

    def pack(self, content: bytes, like: bytes = b"") -> bytes:
        return b":" + (content + bytes((-sum(content) % 256,))).hex().upper().encode() + b"\r\n"

    def unpack(self, data: bytes) -> bytes | None:
        try:
            content = bytes.fromhex(data[1:-2].decode("ascii"))
        except ValueError:
            return None
        good = data[:1] == b":" and data[-2:] == b"\r\n" and len(content) > 2 and not sum(content) % 256
        return content[:-1] if good else None


class Tcp:
    """Number, zero, length, unit, PDU; a reply carries the number of its request (``like``)."""

    def pack(self, content: bytes, like: bytes = b"") -> bytes:
        return like[:2] + b"\0\0" + len(content).to_bytes(2, "big") + content

    def unpack(self, data: bytes) -> bytes | None:
        return (
            data[6:] if data[2:4] == b"\0\0" and len(data) - 6 == int.from_bytes(data[4:6], "big") else None
        )


FRAMINGS = {"rtu": Rtu, "ascii": Ascii, "tcp": Tcp}


def read_request(unit: int, address: int, count: int) -> bytes:
    """Unit and PDU of a read of holding registers."""
    return bytes((unit, READ)) + address.to_bytes(2, "big") + count.to_bytes(2, "big")
