"""Panel in the sidebar of the 3D view."""

import textwrap

import bpy

from . import label_sets, preferences, questions, session, sliders
from .without_blender import faults, marks, variation

WIDTH = 44
"""Characters per row at the sidebar's default width."""


class VIEW3D_PT_posefield(bpy.types.Panel):
    """Panel with model, controls, import and trust of the clip."""

    bl_label = "posefield"
    bl_category = "posefield"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context):
        """Draw the panel; without a card, draw the reason in place of the controls."""
        layout, scene = self.layout, context.scene
        draw_service(layout, context)
        draw_performance(layout, scene.posefield)
        try:
            card = questions.card_of(scene)
        except faults.Fault as fault:
            draw_text(layout, str(fault), "INFO")
            return draw_said(layout)
        draw_controls(layout, scene, card)
        draw_labels(layout, scene.posefield)
        draw_variation(layout, scene.posefield, card)
        draw_choices(layout, scene.posefield, card)
        draw_import(layout, context)
        draw_trust(layout, scene, card)
        return draw_said(layout)


def draw_service(layout, context) -> None:
    """Draw address, refresh button and model."""
    row = layout.row(align=True)
    row.prop(preferences.of(context), "address", text="")
    row.operator("posefield.refresh", text="", icon="FILE_REFRESH")
    layout.prop(context.scene.posefield, "model")


def draw_performance(layout, own) -> None:
    """Draw the script of a performance and its button, in a file with texts."""
    if own.script is not None or bpy.data.texts:
        layout.prop(own, "script")
        layout.operator("posefield.perform_script", icon="PLAY").set_scene = own.set_scene


def draw_controls(layout, scene, card) -> None:
    """Draw a slider for each control, and its sampled values if they are few."""
    column = layout.column(align=True)
    for control in card.controls:
        column.prop(getattr(scene, sliders.PLACE), sliders.attribute(control), slider=True)
        if control.values:
            column.label(text=f"sampled: {control.sampled}")
    layout.operator("posefield.reset")


def draw_labels(layout, own) -> None:
    """Draw the choice in each label set, and the weights of a mixture."""
    for choice in own.labels:
        layout.prop(choice, "choice", text=choice.name.capitalize())
        if choice.mixed:
            column = layout.column(align=True)
            for each in choice.weights:
                column.prop(each, "weight", text=each.name, slider=True)
            draw_mark(layout, marks.weights(choice.value), "INFO", "ERROR")


def draw_variation(layout, own, card) -> None:
    """Draw take and feet; details and feet for models that have them, or where they are set."""
    row = layout.row(align=True)
    row.prop(own, "take")
    row.operator("posefield.next_take", icon="FORWARD")
    row = layout.row()
    row.enabled = own.take > 0
    row.prop(own, "variety", slider=True)
    if card.detail or own.detail:
        layout.prop(own, "detail")
    if card.feet or own.feet != variation.MODEL_DEFAULT:
        layout.prop(own, "feet")
    if card.feet or own.floor:
        layout.prop(own, "floor")


def draw_choices(layout, own, card) -> None:
    """Draw the other settings of a request."""
    layout.prop(own, "level")
    layout.prop(own, "root")
    row = layout.row()
    row.enabled = card.cyclic
    row.prop(own, "loop")
    layout.prop(own, "rate")
    if own.rate == "OWN":
        layout.prop(own, "fps")
    layout.prop(own, "start")
    layout.prop(own, "set_scene")


def draw_import(layout, context) -> None:
    """Draw the import buttons, for a new armature and for the active one, and the live switch."""
    own = context.scene.posefield
    made = layout.operator("posefield.import_clip", icon="IMPORT")
    made.onto, made.set_scene = "NEW", own.set_scene
    active = context.view_layer.objects.active
    if active is not None and active.type == "ARMATURE":
        onto = layout.operator("posefield.import_clip", text=f"Import onto {active.name}")
        onto.onto, onto.set_scene = "ACTIVE", own.set_scene
    layout.prop(own, "character")
    layout.prop(own, "live")


def draw_trust(layout, scene, card) -> None:
    """Draw the clip's sigma and support, and controls outside the sampled range."""
    clip, now = session.current.clip, sliders.values(scene, card)
    labels, varied = label_sets.values(scene.posefield), questions.variation_of(scene.posefield)
    # Sigma holds for the clip's controls and labels only; hide it when the settings differ.
    same = clip is not None and clip.answers(card.identity, now, labels)
    if same and varied.matches(clip.trust):
        far, whom = f"{100 * clip.sigma:.1f} cm", "the prediction" if varied.seed else "this"
        draw_text(layout, f"A captured clip would lie about {far} from {whom}", "INFO")
        draw_mark(layout, marks.support(clip.trust), "CHECKMARK", "ERROR")
        draw_mark(layout, marks.performer(clip.trust), "USER", "GHOST_DISABLED")
        draw_mark(layout, marks.curves(clip.curves), "SHAPEKEY_DATA", "SHAPEKEY_DATA")
        for sentence in varied.feet_sentences(clip.trust, card.why_no_stances):
            draw_text(layout, sentence, "INFO")
    for warning in card.warnings(now):
        draw_text(layout, f"Outside: {warning}", "ERROR")


def draw_mark(layout, mark, good: str, other: str) -> None:
    """Draw a mark with its icon; nothing without a mark."""
    if mark is not None:
        draw_text(layout, mark.words, good if mark.held else other)


def draw_said(layout) -> None:
    """Draw the last report."""
    for sentence in session.current.said:
        draw_text(layout, sentence, "CANCEL" if session.current.failed else "CHECKMARK")


def draw_text(layout, text: str, icon: str) -> None:
    """Draw a sentence, wrapped to several rows."""
    column = layout.column(align=True)
    column.alert = icon in ("ERROR", "CANCEL")
    for place, line in enumerate(textwrap.wrap(text, WIDTH)):
        column.label(text=line, icon="BLANK1" if place else icon)


CLASSES = (VIEW3D_PT_posefield,)
