"""A clip as a BVH file, usually in centimetres: the unit that readers take its numbers to be in."""

from service.encode import axes
from service.encode.convention import Convention
from service.motion import bvh as motion_file
from service.motion.answer import ClipAnswer


def bvh(answer: ClipAnswer, convention: Convention) -> bytes:
    """BVH; the format has no place for the trust facts, nor for unit and axis."""
    clip = axes.moved(Convention(1.0, convention.up), answer.clip)
    return motion_file.dumps(clip, metres_per_unit=convention.metres_per_unit)
