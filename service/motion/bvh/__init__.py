"""BVH motion files: strict reading, conversion to a clip, and writing."""

from service.motion.bvh.boundary import to_clip
from service.motion.bvh.grammar import BvhFile, BvhJoint
from service.motion.bvh.reader import loads, read
from service.motion.bvh.writer import dumps

__all__ = ["BvhFile", "BvhJoint", "dumps", "loads", "read", "to_clip"]
