"""Clips as BVH files, by default in centimetres: the unit that BVH readers assume."""

from service.encode import axes
from service.encode.convention import Convention
from service.motion import bvh_writer
from service.motion.answer import ClipAnswer


def bvh(answer: ClipAnswer, convention: Convention) -> bytes:
    """Return a BVH file; the format cannot store provenance, unit or up axis."""
    clip = axes.moved(Convention(1.0, convention.up), answer.clip)
    return bvh_writer.dumps(clip, metres_per_unit=convention.metres_per_unit)
