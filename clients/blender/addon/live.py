"""Live updates of the imported clip: requests in a thread, results applied by a Blender timer."""

import bpy

from . import scene as scenes
from . import settings, state
from .without_blender import card as cards
from .without_blender.latest import Latest
from .without_blender.service import Answer, Fault

INTERVAL = 0.05
"""Seconds between two checks for a response."""

asking: Latest | None = None
"""Thread of the requests; None without requests."""


def changed(scene) -> None:
    """Request the clip again after a change of a setting, if live updates are on."""
    global asking
    if state.current.taking or not scene.posefield.live:
        return
    try:
        scenes.existing(scene, scene.posefield.character)
        asked = settings.service(), settings.card_of(scene).identity, settings.question(scene)
    except Fault as fault:
        state.current.tell(str(fault), failed=True)
        return
    if asking is None:
        asking = Latest(_answer)
    asking.ask((*asked, scene.name))
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=INTERVAL)


def tick() -> float | None:
    """Apply a response, if there is one; return the seconds to the next call, None to end."""
    if asking is None:
        return None
    for result in asking.take():
        try:
            if isinstance(result, Exception):
                raise result
            _apply(*result)
        except Fault as fault:
            state.current.tell(str(fault), failed=True)
        _redraw()
    return INTERVAL if asking is not None and asking.busy else None


def stop() -> None:
    """Drop pending requests, and end the timer."""
    global asking
    asking = None
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)


def _answer(asked) -> tuple[Answer, bool, str]:
    """Fetch the clip; runs in the thread, where bpy must not be used."""
    service, model, question, scene = asked
    answer = service.fetch(f"{cards.path(model)}/clip.glb", question)
    return answer, bool(question["loop"]), scene


def _apply(answer: Answer, loop: bool, name: str) -> None:
    scene = bpy.data.scenes.get(name)
    if scene is not None and scene.posefield.live:
        replaced = scenes.existing(scene, scene.posefield.character)
        said = put_clip(scene, answer, loop, replaced.name, replaced)
        state.current.tell(*said)


def put_clip(scene, answer: Answer, loop: bool, name: str, replaced=None) -> list[str]:
    """Import a clip as the scene's character and return sentences on it."""
    own = scene.posefield
    armature = scenes.import_character(answer.content, name, own.start, replaced)
    said = scenes.repeat(armature) if loop else []
    if own.set_range:
        # The last key of a loop repeats its first and is not played.
        said += scenes.set_range(scene, own.start, scenes.last_frame(armature) - loop)
    own.character = armature
    return answer.sentences + said


def _redraw() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "PROPERTIES"):
                area.tag_redraw()
