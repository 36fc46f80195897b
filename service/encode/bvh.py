"""A clip as a BVH file, in centimetres: the unit that readers of BVH take numbers to be in."""

from service.motion import bvh as motion_file
from service.motion.answer import ClipAnswer

METRES_PER_UNIT = 0.01


def bvh(answer: ClipAnswer) -> bytes:
    """BVH in centimetres; the format has no place for the trust facts."""
    return motion_file.dumps(answer.clip, metres_per_unit=METRES_PER_UNIT)
