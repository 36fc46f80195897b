"""Reader of USD and glTF files in Blender with default options: blender_read.py FOLDER RESULT.npz.

For each character of a file the result holds FILE/NAME/joints, and FILE/NAME/matrices (F, J, 4, 4):
the joints in the world, column vectors, Y up, metres. A file without animation has no frames.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

# Blender's Z is up: (x, y, z) of the file is (x, -z, y) there.
TO_Y_UP = np.array([(1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)], dtype=float)


def read(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.suffix == ".glb":
        return read_gltf(path)
    bpy.ops.wm.usd_import(filepath=str(path))
    return {character(found): motion(found) for found in armatures()}


def read_gltf(path):
    """The one character, whose bones are turned back to the axes that the file gave them: Blender
    gives bones axes of its own, the same in every pose."""
    bpy.ops.import_scene.gltf(filepath=str(path))
    (armature,) = armatures()
    joints, matrices = motion(armature)
    bones = armature.data.bones
    rest = [TO_Y_UP @ np.array(armature.matrix_world @ bones[name].matrix_local) for name in joints]
    turned = np.array(rest)[:, :3, :3]
    matrices[..., :3, :3] = matrices[..., :3, :3] @ np.swapaxes(turned, -1, -2)
    return {"Character": (joints, matrices)}


def armatures():
    return [found for found in bpy.data.objects if found.type == "ARMATURE"]


def character(armature):
    return armature.parent.name if armature.parent else ""


def motion(armature):
    joints = [bone.name for bone in armature.pose.bones]
    matrices = [pose(armature, joints, frame) for frame in frames(armature)]
    return joints, np.array(matrices).reshape(-1, len(joints), 4, 4)


def frames(armature):
    if not armature.animation_data or not armature.animation_data.action:
        return range(0)
    data = armature.animation_data
    curves = data.action.layers[0].strips[0].channelbag(data.action_slot).fcurves
    return sorted({key.co.x for key in next(iter(curves)).keyframe_points})


def pose(armature, joints, frame):
    whole = int(frame // 1)
    bpy.context.scene.frame_set(whole, subframe=frame - whole)
    bones = armature.pose.bones
    return [TO_Y_UP @ np.array(armature.matrix_world @ bones[name].matrix) for name in joints]


def main(folder, result):
    found = {}
    paths = [path for path in Path(folder).iterdir() if path.suffix[:4] in (".usd", ".glb")]
    for path in sorted(paths):
        for name, (joints, matrices) in read(path).items():
            found[f"{path.name}/{name}/joints"] = np.array(joints, str)
            found[f"{path.name}/{name}/matrices"] = matrices
    np.savez(result, **found)


if __name__ == "__main__":
    main(*sys.argv[1:])
