"""BVH motion files: strict reading, and conversion to a clip."""

from posefield_train.source.bvh.bvh_content import BvhFile, BvhJoint
from posefield_train.source.bvh.bvh_conversion import motion_file, to_clip
from posefield_train.source.bvh.bvh_reader import loads, read

__all__ = ["BvhFile", "BvhJoint", "loads", "motion_file", "read", "to_clip"]
