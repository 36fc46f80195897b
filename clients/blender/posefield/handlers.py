"""When another file is loaded, nothing of the one before is still asked or applied."""

import bpy
from bpy.app.handlers import persistent

from . import live, session


@persistent
def before_load(*_) -> None:
    """Whatever comes back belongs to a file that is gone."""
    live.stop()
    session.current.clip = None
    session.current.tell()


@persistent
def after_load(*_) -> None:
    """A file that is opened asks nobody by itself."""
    for scene in bpy.data.scenes:
        scene.posefield.live = False


def register() -> None:
    """Know of loaded files."""
    bpy.app.handlers.load_pre.append(before_load)
    bpy.app.handlers.load_post.append(after_load)


def unregister() -> None:
    """Care for them no more."""
    bpy.app.handlers.load_pre.remove(before_load)
    bpy.app.handlers.load_post.remove(after_load)
    session.forget()
