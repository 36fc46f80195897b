"""Blocks of clips whose whole motions are computed with at once, and memory between stages."""

import ctypes
import sys

CLIPS_TOGETHER = 300
"""Clips of a block; temporary arrays of the motions of more would take gigabytes."""


def clip_blocks(clips: int) -> list[slice]:
    """Return the blocks of at most CLIPS_TOGETHER clips."""
    starts = range(0, clips, CLIPS_TOGETHER)
    return [slice(start, min(start + CLIPS_TOGETHER, clips)) for start in starts]


def return_freed_memory() -> None:
    """Give memory that was freed back to the system, where the C library can be told to.

    Arrays of single clips, freed between others that stay, leave holes that larger arrays do not
    fit in: 0.4 MB a clip after reading. Only glibc has this function.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)
