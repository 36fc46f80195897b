"""Reader of a BVH file in Blender, with the settings of docs/tools/blender.md: FILE RESULT.npz.

The result holds joints (J,) and places (F, J, 3): heads of the bones in the world, Y up, metres.
"""

import sys

import bpy
import numpy as np

SETTINGS = {"global_scale": 0.01, "axis_forward": "-Z", "axis_up": "Y"}


def read(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_anim.bvh(filepath=path, update_scene_fps=True, **SETTINGS)
    (armature,) = (found for found in bpy.data.objects if found.type == "ARMATURE")
    first, last = map(round, armature.animation_data.action.frame_range)
    places = [heads(armature, frame) for frame in range(first, last + 1)]
    x, y, z = np.moveaxis(np.array(places), -1, 0)
    # Blender's Z is up.
    return [bone.name for bone in armature.pose.bones], np.stack([x, z, -y], axis=-1)


def heads(armature, frame):
    bpy.context.scene.frame_set(frame)
    return [list(armature.matrix_world @ bone.head) for bone in armature.pose.bones]


if __name__ == "__main__":
    joints, places = read(sys.argv[1])
    rate = bpy.context.scene.render.fps / bpy.context.scene.render.fps_base
    np.savez(sys.argv[2], joints=joints, places=places, rate=rate)
