"""Writer of motion files in Blender: CLIP.glb FPS FOLDER; writes blender.fbx, .glb and .usdc there.

Blender turns the joints of the clip to bones along their own y, so that the files it writes have
rest poses with rotations, as those of its users.
"""

import sys

import bpy


def write(source, rate, folder):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = round(rate)
    bpy.ops.import_scene.gltf(filepath=source)
    for helper in [found for found in bpy.data.objects if found.type not in ("ARMATURE", "MESH")]:
        bpy.data.objects.remove(helper)
    (armature,) = (found for found in bpy.data.objects if found.type == "ARMATURE")
    first, last = map(round, armature.animation_data.action.frame_range)
    scene.frame_start, scene.frame_end = first, last
    bpy.ops.export_scene.fbx(
        filepath=f"{folder}/blender.fbx",
        add_leaf_bones=False,
        bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False,
        bake_anim_simplify_factor=0.0,
    )
    bpy.ops.export_scene.gltf(filepath=f"{folder}/blender.glb")
    bpy.ops.wm.usd_export(filepath=f"{folder}/blender.usdc", export_animation=True)


if __name__ == "__main__":
    write(sys.argv[1], float(sys.argv[2]), sys.argv[3])
