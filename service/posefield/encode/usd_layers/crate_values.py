"""Numbers of a binary USD layer as bytes, and descriptions of its values.

A value is described by 64 bits: flags, its type, and in the last 48 its offset or the value itself
(pxr/usd/sdf/crateFile.h, `ValueRep`). A dictionary or a list of samples has an offset from where it
lies to the description of each value in it.
"""

import struct

COUNT, INDEX, JUMP, FLOAT, DOUBLE = (struct.Struct(form) for form in ("<Q", "<I", "<q", "<f", "<d"))
"""A count or a description, an index of a text, an offset from its own place, and numbers."""
ALIGNMENT = 8
"""Of the offsets of arrays, which readers use where they lie."""
OFFSET_BITS = 48
ARRAY, INLINED = 1 << 63, 1 << 62
"""Flags of an array, and of a value that its description holds."""
TYPES = {bool: 1 << 48, int: 3 << 48, float: 9 << 48, str: 10 << 48, dict: 31 << 48}
"""Types of values: truths, integers of 32 bits, float64, texts, dictionaries."""
LONG_INTEGER = 5 << 48
"""Type of integers of 64 bits."""
