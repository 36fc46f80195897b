"""BVH motion files: strict reading, and conversion to a clip."""

from model_export.bvh.boundary import to_clip
from model_export.bvh.grammar import BvhFile, BvhJoint
from model_export.bvh.reader import loads, read

__all__ = ["BvhFile", "BvhJoint", "loads", "read", "to_clip"]
