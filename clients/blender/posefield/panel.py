"""The panel in the sidebar of the 3D view."""

import textwrap

import bpy

from . import preferences, questions, session, sliders
from .without_blender import faults, marks

WIDTH = 44
"""Letters that a row holds at the sidebar's usual width."""


class VIEW3D_PT_posefield(bpy.types.Panel):
    """Model, controls, and what becomes of the clip."""

    bl_label = "posefield"
    bl_category = "posefield"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context):
        """Everything from top to bottom; what is not known yet is left out."""
        layout, scene = self.layout, context.scene
        draw_service(layout, context)
        try:
            card = questions.card_of(scene)
        except faults.Fault as fault:
            draw_text(layout, str(fault), "INFO")
            return draw_said(layout)
        draw_controls(layout, scene, card)
        draw_choices(layout, scene.posefield, card)
        draw_import(layout, context)
        draw_trust(layout, scene, card)
        return draw_said(layout)


def draw_service(layout, context) -> None:
    """Address, refresh and model."""
    row = layout.row(align=True)
    row.prop(preferences.of(context), "address", text="")
    row.operator("posefield.refresh", text="", icon="FILE_REFRESH")
    layout.prop(context.scene.posefield, "model")


def draw_controls(layout, scene, card) -> None:
    """A slider for each control, and the values that were sampled where they are few."""
    column = layout.column(align=True)
    for control in card.controls:
        column.prop(getattr(scene, sliders.PLACE), sliders.attribute(control), slider=True)
        if control.values:
            column.label(text=f"sampled: {control.sampled}")
    layout.operator("posefield.reset")


def draw_choices(layout, own, card) -> None:
    """What else is asked for."""
    if card.performers:
        layout.prop(own, "performer")
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
    """Import, onto a new armature or the active one, and live."""
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
    """What the clip is worth, and where it leaves what was sampled."""
    clip, now = session.current.clip, sliders.values(scene, card)
    who = scene.posefield.performer_name or None
    # It belongs to one point: it is not shown beside sliders that stand elsewhere.
    if clip is not None and clip.answers(card.identity, now, who):
        far = f"{100 * clip.sigma:.1f} cm"
        draw_text(layout, f"A captured clip would lie about {far} from this", "INFO")
        draw_mark(layout, marks.support(clip.trust), "CHECKMARK", "ERROR")
        draw_mark(layout, marks.performer(clip.trust), "USER", "GHOST_DISABLED")
    for warning in card.warnings(now):
        draw_text(layout, f"Outside: {warning}", "ERROR")


def draw_mark(layout, mark, good: str, other: str) -> None:
    """Words under a sign of their own; nothing where the service does not say."""
    if mark is not None:
        draw_text(layout, mark.words, good if mark.held else other)


def draw_said(layout) -> None:
    """What was last reported."""
    for sentence in session.current.said:
        draw_text(layout, sentence, "CANCEL" if session.current.failed else "CHECKMARK")


def draw_text(layout, text: str, icon: str) -> None:
    """A sentence in as many rows as it takes."""
    column = layout.column(align=True)
    column.alert = icon in ("ERROR", "CANCEL")
    for place, line in enumerate(textwrap.wrap(text, WIDTH)):
        column.label(text=line, icon="BLANK1" if place else icon)


CLASSES = (VIEW3D_PT_posefield,)
