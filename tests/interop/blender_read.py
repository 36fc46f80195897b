"""Reads USD files in Blender with its default options: blender_read.py FOLDER RESULT.npz.

For each character of a file the result holds FILE/NAME/joints, and FILE/NAME/matrices (F, J, 4, 4):
the joints in the world, column vectors, Y up, metres. Without an animation it has no frames.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

# Blender's Z is up: (x, y, z) of the file is (x, -z, y) there.
TO_Y_UP = np.array([(1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)], dtype=float)


def read(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(path))
    armatures = [found for found in bpy.data.objects if found.type == "ARMATURE"]
    return {character(found): motion(found) for found in armatures}


def character(armature):
    return armature.parent.name if armature.parent else ""


def motion(armature):
    joints = [bone.name for bone in armature.pose.bones]
    matrices = [pose(armature, joints, frame) for frame in frames(armature)]
    return joints, np.array(matrices).reshape(-1, len(joints), 4, 4)


def frames(armature):
    if not armature.animation_data or not armature.animation_data.action:
        return range(0)
    start, end = armature.animation_data.action.frame_range
    return range(round(start), round(end) + 1)


def pose(armature, joints, frame):
    bpy.context.scene.frame_set(frame)
    bones = armature.pose.bones
    return [TO_Y_UP @ np.array(armature.matrix_world @ bones[name].matrix) for name in joints]


def main(folder, result):
    found = {}
    for path in sorted(Path(folder).glob("*.usd*")):
        for name, (joints, matrices) in read(path).items():
            found[f"{path.name}/{name}/joints"] = np.array(joints, str)
            found[f"{path.name}/{name}/matrices"] = matrices
    np.savez(result, **found)


if __name__ == "__main__":
    main(*sys.argv[1:])
