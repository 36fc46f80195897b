"""Body of bones: one tapered box per bone, tinted by its side, each skinned to one joint."""

import numpy as np

from posefield.encode.body import bone_boxes
from posefield.encode.body.bone_boxes import POINTS_PER_BOX, RING_POSITIONS
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, SkinnedMesh, distinct_places
from posefield.motion.skeleton import Skeleton


def bones_body(skeleton: Skeleton) -> SkinnedMesh:
    """Return the boxes of a skeleton as a mesh whose points follow both ends of their bones."""
    bones = bone_boxes.bones(skeleton)
    boxes = bone_boxes.bone_boxes(skeleton, bones, skeleton.offsets)
    points, normals = bone_boxes.points_and_normals(boxes)
    counts, corners = bone_boxes.faces(bones)
    ends = np.concatenate([bones.ends, bones.joints[len(bones.ends) :]])
    anchors = np.repeat(np.stack([bones.joints, ends], axis=-1), POINTS_PER_BOX, axis=0)
    joints = np.repeat(bones.joints, POINTS_PER_BOX)[:, None]
    shares = np.tile(RING_POSITIONS.reshape(-1).astype(float), len(ends))
    return SkinnedMesh(
        np.ascontiguousarray(points, np.float32),
        np.ascontiguousarray(normals, np.float32),
        *distinct_places(anchors, shares),
        joints,
        np.full(joints.shape, FULL_WEIGHT, np.uint8),
        counts,
        corners,
        np.repeat(bones.tints, POINTS_PER_BOX),
    )
