"""USDZ: a zip archive that stores its one layer unpacked and aligned, so that it can be mapped."""

import struct
import zlib

from service.encode import usd
from service.motion.answer import ClipAnswer

NAME = b"clip.usdc"
ALIGNMENT = 64
PADDING = 0x1986
"""Identifier of the extra field that pxr's own writer pads with."""

# 1980-01-01 00:00, the first moment a zip archive can name: the bytes hang on the clip alone.
TIME, DATE = 0, 0x21
LOCAL = struct.Struct("<4s5H3L2H")
CENTRAL = struct.Struct("<4s6H3L5H2L")
END = struct.Struct("<4s4H2LH")


def usdz(answer: ClipAnswer) -> bytes:
    """USDZ of one binary layer."""
    return package(usd.usdc(answer))


def package(data: bytes) -> bytes:
    """Archive of one stored file whose data start at a multiple of 64 bytes."""
    # Version 1.0, no flags, method 0 (stored).
    common = (10, 0, 0, TIME, DATE, zlib.crc32(data), len(data), len(data), len(NAME))
    padding = _padding(LOCAL.size + len(NAME))
    local = LOCAL.pack(b"PK\3\4", *common, len(padding)) + NAME + padding
    central = CENTRAL.pack(b"PK\1\2", 10, *common, 0, 0, 0, 0, 0, 0) + NAME
    end = END.pack(b"PK\5\6", 0, 0, 1, 1, len(central), len(local) + len(data), 0)
    return b"".join((local, data, central, end))


def _padding(before: int) -> bytes:
    """Extra field, of four bytes or more, that ends at a multiple of the alignment."""
    length = -(before + 4) % ALIGNMENT
    return struct.pack("<2H", PADDING, length) + bytes(length)
