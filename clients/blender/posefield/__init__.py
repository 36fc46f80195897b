"""posefield in Blender: pick a model of a motion service, set its controls, and import the clip.

The panel stands in the sidebar of the 3D view. Whatever needs no Blender is in `without_blender`;
`rig` and `action` put a clip on an armature, `live` keeps it as the sliders say.
"""

from . import handlers, live, operators, panel, preferences, properties, sliders

CLASSES = (*preferences.CLASSES, *properties.CLASSES, *operators.CLASSES, *panel.CLASSES)


def register() -> None:
    """Called by Blender when the add-on is switched on."""
    properties.register(CLASSES)
    handlers.register()


def unregister() -> None:
    """Called by Blender when it is switched off: no timer or handler is left.

    A thread that still asks ends with its answer, which is dropped, or at the timeout.
    """
    handlers.unregister()
    live.stop()
    sliders.remove()
    properties.unregister(CLASSES)
