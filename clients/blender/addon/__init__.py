"""Blender add-on: motions of a posefield service, as characters that Blender's importers make.

The panel is in the sidebar of the 3D view. `without_blender` has the code without bpy, `scene`
imports files, `live` updates a clip when a slider moves.
"""

import bpy
from bpy.app.handlers import persistent

from . import live, operators, panel, settings, state

CLASSES = (*settings.CLASSES, *operators.CLASSES, *panel.CLASSES)


@persistent
def before_load(*_) -> None:
    """Drop requests and messages, which belong to the file that is closed."""
    live.stop()
    state.current.tell()


@persistent
def after_load(*_) -> None:
    """Turn live updates off, so that an opened file sends no request by itself."""
    for scene in bpy.data.scenes:
        scene.posefield.live = False


def register() -> None:
    """Register the add-on; called by Blender when it is enabled."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.posefield = bpy.props.PointerProperty(type=settings.PosefieldSettings)
    bpy.app.handlers.load_pre.append(before_load)
    bpy.app.handlers.load_post.append(after_load)


def unregister() -> None:
    """Unregister the add-on, with its timer and handlers; called when it is disabled."""
    bpy.app.handlers.load_pre.remove(before_load)
    bpy.app.handlers.load_post.remove(after_load)
    live.stop()
    settings.remove_controls()
    del bpy.types.Scene.posefield
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
