"""Blender add-on: pick a model of a motion service, set its controls, and import the clip; or
import the performance of a script.

The panel is in the sidebar of the 3D view. `without_blender` has the code without bpy, `rig` and
`action` write a clip to an armature, `live` updates it when a slider moves.
"""

from . import (
    handlers,
    label_sets,
    live,
    operators,
    panel,
    performing,
    preferences,
    properties,
    sliders,
)

CLASSES = (
    *preferences.CLASSES,
    *label_sets.CLASSES,
    *properties.CLASSES,
    *operators.CLASSES,
    *performing.CLASSES,
    *panel.CLASSES,
)


def register() -> None:
    """Register the add-on; called by Blender when it is enabled."""
    properties.register(CLASSES)
    handlers.register()


def unregister() -> None:
    """Unregister the add-on, with all timers and handlers; called by Blender when it is disabled.

    A thread with a pending request ends with its response, which is dropped, or at the timeout.
    """
    handlers.unregister()
    live.stop()
    sliders.remove()
    properties.unregister(CLASSES)
