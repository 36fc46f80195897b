"""Operator that performs a script: a text block to an action, with markers in the timeline."""

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from . import action, placing, preferences, questions, rig, session
from .without_blender import bones, cards, faults, scripts
from .without_blender.cards import Card
from .without_blender.clips import Clip

MARK = "posefield_script"
"""Property of an armature: name of the text block that was performed on it last."""

KEEPS = "posefield_script_keeps_lengths"
"""Property of an armature that was there before, and keeps its bone lengths."""


class POSEFIELD_OT_perform_script(bpy.types.Operator):
    """Import the performance of a script as an action, with markers at its segments"""

    bl_idname = "posefield.perform_script"
    bl_label = "Perform script"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    text: StringProperty(name="Text", description="Name of the text block; the panel's, if empty")
    onto: EnumProperty(
        name="Onto",
        items=[
            ("OWN", "The script's armature", "The one that it was performed on, else a new one"),
            ("NEW", "A new armature", "Made for the performance, with its bone lengths"),
            ("ACTIVE", "The active armature", "Whose bones have the names of the joints"),
        ],
    )
    set_scene: BoolProperty(
        name="Set scene rate and range",
        description="The scene plays the performance as fast as it is, and from end to end",
        default=True,
    )

    def execute(self, context):
        """Fetch the performance, check that it fits, and only then change the scene."""
        try:
            text = self._text(context.scene)
            armature = self._armature(context, text)
            source = text.as_string()
            asked = preferences.service(context).in_all()
            clip = scripts.ask(asked, source, questions.fps(context.scene))
            card = replace(cards.get(asked, scripts.character(clip)), name=text.name)
            _check(armature, clip)
        except faults.InScript as fault:
            # The text editor shows the line.
            text.cursor_set(fault.line - 1)
            return session.ended(self, [f"{text.name}, {fault}"], "ERROR")
        except faults.Fault as fault:
            return session.ended(self, [str(fault)], "ERROR")
        said = self._put(context, armature, card, clip)
        return session.ended(self, [*said, *scripts.sentences(clip, source)])

    def _text(self, scene):
        if not self.text:
            if scene.posefield.script is None:
                raise faults.Fault("no text block is picked: pick one with a script")
            return scene.posefield.script
        if self.text not in bpy.data.texts:
            known = ", ".join(bpy.data.texts.keys()) or "none"
            raise faults.Fault(f"no text block is named {self.text}; there are {known}")
        return bpy.data.texts[self.text]

    def _armature(self, context, text):
        if self.onto == "ACTIVE":
            return rig.active(context)
        if self.onto == "NEW":
            return None
        own = (each for each in context.scene.objects if each.get(MARK) == text.name)
        found = next((each for each in own if each.type == "ARMATURE"), None)
        return None if found is None else rig.editable(found)

    def _put(self, context, armature, card: Card, clip: Clip) -> list[str]:
        scene, said = context.scene, []
        made = armature is None
        keep_lengths = self.onto == "ACTIVE" or (not made and KEEPS in armature)
        if made:
            armature = rig.make(context, card, clip)
        elif keep_lengths:
            said += bones.differences(clip, rig.rest(armature, clip)) + rig.settle(armature)
        else:
            said += rig.settle(armature)
        if made or armature.get(MARK) != card.name or not _has_own_action(armature):
            said += action.begin(armature, card.name)
        armature[MARK] = card.name
        if keep_lengths:
            armature[KEEPS] = True
        if self.set_scene:
            said += placing.set_scene(scene, armature, clip, False)
        placing.put(scene, armature, clip, keep_lengths, False)
        _put_markers(scene, card.name, clip)
        return [_summary(card, armature, clip), *said]


def _check(armature, clip: Clip) -> None:
    if armature is None:
        bones.check_names(clip)
    else:
        rig.check(armature, clip)


def _has_own_action(armature) -> bool:
    data = armature.animation_data
    return bool(data and data.action and action.MARK in data.action)


def _put_markers(scene, name: str, clip: Clip) -> None:
    """Replace the markers of a script, which begin with its name, by those of its performance."""
    begin = f"{name}: "
    # Markers have no custom properties in Blender 5.
    for marker in [each for each in scene.timeline_markers if each.name.startswith(begin)]:
        scene.timeline_markers.remove(marker)
    for each in scripts.moments(clip):
        frame = placing.frame_of(scene, clip, each.time)
        scene.timeline_markers.new(begin + each.words, frame=frame)


def _summary(card: Card, armature, clip: Clip) -> str:
    seconds, far = (len(clip) - 1) / clip.rate, 100.0 * clip.sigma
    found = f"{card.name} on {armature.name}: {seconds:.1f} s, {len(clip)} frames"
    return f"{found}; captured motion would lie about {far:.1f} cm away"


CLASSES = (POSEFIELD_OT_perform_script,)
