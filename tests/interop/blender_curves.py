"""Reader of shape keys in Blender: blender_curves.py RESULT.npz FILE...

For each file the result holds FILE/names and FILE/values (F, C) of the keys of its mesh, at each
key of their animation.
"""

import sys
from pathlib import Path

import bpy
import numpy as np


def read(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.suffix == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path))
    else:
        bpy.ops.wm.usd_import(filepath=str(path))
    (keys,) = [mesh.shape_keys for mesh in bpy.data.meshes if mesh.shape_keys]
    blocks = [block for block in keys.key_blocks if block != keys.reference_key]
    action = keys.animation_data.action
    # An action of glTF moves bones and shape keys, each in a bag of its own.
    bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
    own = [curve for bag in bags for curve in bag.fcurves if blocks[0].name in curve.data_path]
    values = []
    for frame in sorted(key.co.x for key in own[0].keyframe_points):
        bpy.context.scene.frame_set(int(frame // 1), subframe=frame % 1)
        values.append([block.value for block in blocks])
    return [block.name for block in blocks], np.array(values)


result, *files = sys.argv[1:]
found = {}
for file in map(Path, files):
    found[f"{file.name}/names"], found[f"{file.name}/values"] = read(file)
np.savez(result, **found)
