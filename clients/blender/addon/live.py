"""Live updates of the imported clip: requests in a thread, results applied by a Blender timer."""

import traceback
from dataclasses import dataclass

import bpy

from . import action, placing, preferences, questions, rig, session
from .without_blender import clips, faults
from .without_blender.clips import Clip, Question
from .without_blender.latest import Latest
from .without_blender.service import Service

INTERVAL = 0.02
"""Seconds between two checks for a response; screens are hardly faster."""

asking: Latest | None = None
"""Thread of the requests; None without requests."""


@dataclass(frozen=True)
class Asked:
    """A question, and the name of the scene it belongs to."""

    service: Service
    question: Question
    scene: str


def changed(scene) -> None:
    """Request the clip again after a change of a setting, if live updates are on."""
    if scene.posefield.live:
        try:
            ask(scene)
        except faults.Fault as fault:
            session.current.tell(str(fault), failed=True)


def ask(scene) -> None:
    """Request the clip of the current sliders; a request that still waits is replaced."""
    global asking
    action.own(character(scene))
    asked = Asked(preferences.service(bpy.context), questions.question(scene), scene.name)
    if asking is None:
        asking = Latest(_answered)
    asking.ask(asked)
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=INTERVAL)


def tick() -> float | None:
    """Apply a response, if there is one; return the seconds to the next call, None to end."""
    if asking is None:
        return None
    for found in asking.take():
        _take(found)
    return INTERVAL if asking is not None and asking.busy else None


def stop() -> Latest | None:
    """Drop pending requests, and end timer and thread; return the thread, None if there is none."""
    global asking
    ended, asking = asking, None
    if ended is not None:
        ended.close()
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    return ended


def character(scene):
    """Return the imported armature; raise Fault if it was deleted."""
    found = scene.posefield.character
    # The pointer keeps a deleted object, but no scene contains it.
    if found is None or found.name not in scene.objects:
        raise faults.Fault("there is no imported armature in this scene: import a clip first")
    return found


def _answered(asked: Asked) -> tuple[Asked, Clip]:
    """Fetch the clip; runs in the thread, where bpy must not be used."""
    return asked, clips.ask(asked.service, asked.question)


def _take(found) -> None:
    if isinstance(found, faults.Fault):
        session.current.tell(str(found), failed=True)
    elif isinstance(found, Exception):
        session.current.tell(f"an error in the add-on: {found!r}", failed=True)
        traceback.print_exception(found)
    else:
        _apply(*found)
    _redraw()


def _apply(asked: Asked, clip: Clip) -> None:
    scene = bpy.data.scenes.get(asked.scene)
    if scene is None or not scene.posefield.live:
        return
    try:
        armature = character(scene)
        keep_lengths = action.keeps_lengths(armature)
        rig.check(armature, clip)
    except faults.Fault as fault:
        scene.posefield.live = False
        session.current.tell(str(fault), failed=True)
        return
    loop = asked.question.loop
    placing.put(scene, armature, clip, keep_lengths, loop)
    if scene.posefield.set_scene:
        placing.set_scene(scene, armature, clip, loop)
    session.current.clip = clip
    session.current.tell(*placing.unrepeated(clip, loop))


def _redraw() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "PROPERTIES"):
                area.tag_redraw()
