"""Script that runs inside Blender: FBX_FILE GLB_FILE; each take becomes an animation of the GLB.

glTF is taken between because it states unit and axes and bakes constraints, and because its reader
is tested. Imports of Blender are within the function: this file is not imported by the package.
"""

import sys


def main(source: str, target: str) -> None:
    """Read an FBX file into an empty scene and write its armature with all actions."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.fbx(filepath=source, use_anim=True, ignore_leaf_bones=False)
    settings = {
        "export_format": "GLB",
        "export_animations": True,
        "export_animation_mode": "ACTIONS",
        "export_force_sampling": True,
        "export_optimize_animation_size": False,
        "export_rest_position_armature": True,
        "export_yup": True,
        "export_morph": False,
        "export_materials": "NONE",
    }
    # Options differ between versions of Blender.
    supported = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    options = {name: value for name, value in settings.items() if name in supported}
    bpy.ops.export_scene.gltf(filepath=target, **options)


if __name__ == "__main__":
    after = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    main(*after)
