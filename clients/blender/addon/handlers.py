"""Handlers of loaded files: pending requests and responses of the previous file are dropped."""

import bpy
from bpy.app.handlers import persistent

from . import live, session


@persistent
def before_load(*_) -> None:
    """Stop requests, because their responses belong to the file that is closed."""
    live.stop()
    session.current.clip = None
    session.current.tell()


@persistent
def after_load(*_) -> None:
    """Turn live updates off, so that an opened file sends no request by itself."""
    for scene in bpy.data.scenes:
        scene.posefield.live = False


def register() -> None:
    """Add the handlers."""
    bpy.app.handlers.load_pre.append(before_load)
    bpy.app.handlers.load_post.append(after_load)


def unregister() -> None:
    """Remove the handlers."""
    bpy.app.handlers.load_pre.remove(before_load)
    bpy.app.handlers.load_post.remove(after_load)
    session.forget()
