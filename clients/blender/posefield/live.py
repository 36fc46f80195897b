"""The imported clip follows the sliders: asked in a thread, applied by a timer in Blender's own."""

import traceback
from dataclasses import dataclass

import bpy

from . import action, placing, preferences, questions, rig, session
from .without_blender import clips, faults
from .without_blender.clips import Clip, Question
from .without_blender.latest import Latest
from .without_blender.service import Service

INTERVAL = 0.02
"""Seconds between two looks for an answer; no screen shows more."""

_asking: Latest | None = None


@dataclass(frozen=True)
class Asked:
    """A question, and the scene on whose behalf."""

    service: Service
    question: Question
    scene: str


def changed(scene) -> None:
    """Called when anything of what is asked for changes."""
    if scene.posefield.live:
        try:
            ask(scene)
        except faults.Fault as fault:
            session.current.tell(str(fault), failed=True)


def ask(scene) -> None:
    """Ask for the clip as the sliders are now; what was still waiting is forgotten."""
    global _asking
    action.own(character(scene))
    asked = Asked(preferences.service(bpy.context), questions.question(scene), scene.name)
    if _asking is None:
        _asking = Latest(_answered)
    _asking.ask(asked)
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=INTERVAL)


def tick() -> float | None:
    """Apply an answer, if there is one; seconds until the next look, None at the end."""
    if _asking is None:
        return None
    for found in _asking.take():
        _take(found)
    return INTERVAL if _asking is not None and _asking.busy else None


def stop() -> Latest | None:
    """Forget what was asked, and let timer and thread end; the thread, where there was one."""
    global _asking
    ended, _asking = _asking, None
    if ended is not None:
        ended.close()
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    return ended


def character(scene):
    """The armature that was imported; Fault where it is gone."""
    found = scene.posefield.character
    # A deleted object lives on as long as our pointer holds it, but in no scene.
    if found is None or found.name not in scene.objects:
        raise faults.Fault("there is no imported armature in this scene: import a clip first")
    return found


def _answered(asked: Asked) -> tuple[Asked, Clip]:
    """In the thread: nothing of Blender may be touched here."""
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
