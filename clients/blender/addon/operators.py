"""Operators of the panel's buttons, also for scripts: `bpy.ops.posefield`."""

import json
import math

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from . import (
    action,
    label_sets,
    placing,
    preferences,
    properties,
    questions,
    rig,
    session,
    sliders,
)
from .questions import Picked
from .without_blender import bones, cards, clips, faults, label_choice, variation
from .without_blender.cards import Card
from .without_blender.clips import Clip
from .without_blender.service import Service
from .without_blender.variation import Variation


class POSEFIELD_OT_refresh(bpy.types.Operator):
    """Ask the service which models it has, and for the picked one's controls"""

    bl_idname = "posefield.refresh"
    bl_label = "Refresh"
    bl_options = {"REGISTER"}  # noqa: RUF012

    def execute(self, context):
        """Fetch models and card again; on an error nothing changes."""
        try:
            questions.refresh(context, context.scene)
        except faults.Fault as fault:
            return session.ended(self, [str(fault)], "ERROR")
        return session.ended(self, [])


class POSEFIELD_OT_reset(bpy.types.Operator):
    """Set all controls to their defaults"""

    bl_idname = "posefield.reset"
    bl_label = "Reset controls"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context):
        """Set every slider to its default."""
        try:
            sliders.reset(context.scene, questions.card_of(context.scene))
        except faults.Fault as fault:
            return session.ended(self, [str(fault)], "ERROR")
        return session.FINISHED


class POSEFIELD_OT_next_take(bpy.types.Operator):
    """Choose the seed of the next take; with live updates the clip follows"""

    bl_idname = "posefield.next_take"
    bl_label = "Next take"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context):
        """Raise the seed by one."""
        own = context.scene.posefield
        own.take = variation.next_seed(own.take)
        return session.FINISHED


class POSEFIELD_OT_import_clip(bpy.types.Operator):
    """Import the clip at these controls as an action"""

    bl_idname = "posefield.import_clip"
    bl_label = "Import clip"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    model: StringProperty(name="Model", description="Name of a model; the panel's, if empty")
    controls: StringProperty(
        name="Controls",
        description="JSON object of values by control; the panel's for those it leaves out",
    )
    labels: StringProperty(
        name="Labels",
        description="JSON object of a name, weights by name, or null for unknown, by label set; "
        "the panel's for those it leaves out",
    )
    # Not saved, so that an import from the panel starts from the panel's settings.
    take: IntProperty(
        name="Take",
        description="Seed of another take, 0 for the prediction; the panel's, if not given",
        min=0,
        max=variation.LARGEST_SEED,
        options={"SKIP_SAVE"},
    )
    variety: FloatProperty(
        name="Variety",
        description="Size of a take's deviations; the panel's, if not given",
        default=variation.VARIETY,
        min=0.0,
        max=1.0,
        options={"SKIP_SAVE"},
    )
    detail: BoolProperty(
        name="Sampled detail",
        description="Add details that no control predicts; the panel's, if not given",
        options={"SKIP_SAVE"},
    )
    feet: EnumProperty(
        name="Feet",
        description="Whether feet stand; the panel's, if not given",
        items=properties.FEET_ITEMS,
        options={"SKIP_SAVE"},
    )
    floor: FloatProperty(
        name="Floor",
        description="Height of the floor on which feet stand, m; the panel's, if not given",
        min=-variation.LARGEST_HEIGHT,
        max=variation.LARGEST_HEIGHT,
        options={"SKIP_SAVE"},
    )
    onto: EnumProperty(
        name="Onto",
        items=[
            ("NEW", "A new armature", "Made for the clip, with its bone lengths"),
            ("ACTIVE", "The active armature", "Whose bones have the names of the clip's joints"),
        ],
    )
    lengths: EnumProperty(
        name="Bone lengths",
        items=[
            ("ARMATURE", "The armature's", "Bones turn as in the clip and keep their lengths"),
            ("CLIP", "The clip's", "Bones move to where the clip's joints are"),
        ],
    )
    set_scene: BoolProperty(
        name="Set scene rate and range",
        description="The scene plays the clip as fast as it is, and from end to end",
        default=True,
    )

    def execute(self, context):
        """Fetch the clip, check that it fits, and only then change the scene."""
        try:
            armature = self._armature(context)
            asked = preferences.service(context).in_all()
            picked = self._picked(asked, context.scene)
            others = self._controls(picked.card)
            labels = label_choice.of_json(self.labels, picked.card.labels)
            varied = self._varied()
            question = questions.question_of(context.scene, picked, others, labels, varied)
            clip = clips.ask(asked, question)
            _check(armature, clip)
        except faults.Fault as fault:
            return session.ended(self, [str(fault)], "ERROR")
        if picked.card is not session.current.card:
            questions.take(context.scene, picked)
        said = self._put(context, armature, clip, question.loop)
        session.current.clip = clip
        label_sets.put(context.scene.posefield, labels)
        questions.put_variation(context.scene.posefield, question.variation)
        sliders.put(context.scene, picked.card, others)
        self._tell(question.variation, clip, picked.card)
        return session.ended(self, said)

    def _varied(self) -> dict[str, object]:
        """Return the given fields of Variation: take, variety, detail, feet and floor."""
        given = variation.of_sliders(self.take, self.variety, self.detail, self.feet, self.floor)
        same = {name: name for name in ("variety", "detail", "feet", "floor")}
        fields = {"take": "seed"} | same
        return {
            field: getattr(given, field)
            for name, field in fields.items()
            if self.properties.is_property_set(name)
        }

    def _tell(self, varied: Variation, clip: Clip, card: Card) -> None:
        """Show take and feet as the operator's own settings, and report the feet to scripts."""
        self.take, self.variety = varied.seed, varied.variety
        self.detail, self.feet, self.floor = varied.detail, varied.feet, varied.floor
        for sentence in varied.feet_sentences(clip.trust, card.why_no_stances):
            self.report({"INFO"}, sentence)

    def _armature(self, context):
        return None if self.onto == "NEW" else rig.active(context)

    def _picked(self, asked: Service, scene) -> Picked:
        known, name = session.current.card is not None, scene.posefield.model_name
        if self.model and not (known and self.model == name):
            return Picked(self.model, cards.get(asked, self.model))
        return Picked(name, questions.card_of(scene)) if known else questions.found(asked, scene)

    def _controls(self, card: Card) -> dict[str, float]:
        try:
            given = {
                name: float(value) for name, value in json.loads(self.controls or "{}").items()
            }
        except (ValueError, TypeError, AttributeError) as fault:
            raise faults.Fault(
                f"controls are {self.controls!r}, expected numbers by name"
            ) from fault
        if not all(map(math.isfinite, given.values())):
            raise faults.Fault(f"controls are {self.controls!r}, expected finite numbers")
        known = [control.name for control in card.controls]
        unknown = sorted(set(given) - set(known))
        if unknown:
            raise faults.Fault(f"no control is named {unknown[0]}; there are {', '.join(known)}")
        return given

    def _put(self, context, armature, clip: Clip, loop: bool) -> list[str]:
        scene, card = context.scene, questions.card_of(context.scene)
        said, keep_lengths = [], False
        if armature is None:
            armature = rig.make(context, card, clip)
        else:
            keep_lengths = self.lengths == "ARMATURE"
            said = bones.differences(clip, rig.rest(armature, clip)) if keep_lengths else []
            said += rig.settle(armature)
        said += action.begin(armature, card.name)
        if self.set_scene:
            said += placing.set_scene(scene, armature, clip, loop)
        placing.put(scene, armature, clip, keep_lengths, loop)
        scene.posefield.character = armature
        return [_summary(card, armature, clip), *said, *placing.unrepeated(clip, loop)]


def _check(armature, clip: Clip) -> None:
    if armature is None:
        bones.check_names(clip)
    else:
        rig.check(armature, clip)


def _summary(card: Card, armature, clip: Clip) -> str:
    return f"{card.name} on {armature.name}: {len(clip)} frames at {clip.rate:g} a second"


CLASSES = (
    POSEFIELD_OT_refresh,
    POSEFIELD_OT_reset,
    POSEFIELD_OT_next_take,
    POSEFIELD_OT_import_clip,
)
