"""Panel in the sidebar of the 3D view."""

import textwrap

import bpy

from . import settings, state
from .without_blender.service import Fault

WIDTH = 44
"""Characters per row at the sidebar's default width."""


class VIEW3D_PT_posefield(bpy.types.Panel):
    """Panel with model, controls, imports and messages."""

    bl_label = "posefield"
    bl_category = "posefield"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context):
        """Draw the panel; without a card, draw the reason in place of the controls."""
        layout, scene = self.layout, context.scene
        row = layout.row(align=True)
        row.prop(context.preferences.addons[__package__].preferences, "address", text="")
        row.operator("posefield.refresh", text="", icon="FILE_REFRESH")
        layout.prop(scene.posefield, "model")
        if scene.posefield.script is not None or bpy.data.texts:
            layout.prop(scene.posefield, "script")
            layout.operator("posefield.perform_script", icon="PLAY")
        try:
            draw_question(layout, scene, settings.card_of(scene))
        except Fault as fault:
            draw_text(layout, str(fault), "INFO")
        for sentence in state.current.said:
            draw_text(layout, sentence, "CANCEL" if state.current.failed else "CHECKMARK")


def draw_question(layout, scene, card) -> None:
    """Draw sliders, labels and the other settings of a request, and the import buttons."""
    own, sliders = scene.posefield, getattr(scene, settings.CONTROLS)
    column = layout.column(align=True)
    for control in card.controls:
        column.prop(sliders, settings.attribute(control.name), slider=True)
    for name in card.labels:
        column.prop(sliders, f"label_{name}")
    for sentence in card.outside(settings.controls(scene, card)):
        draw_text(layout, f"Outside: {sentence}", "ERROR")
    layout.operator("posefield.reset")
    for name in ("take", "variety", "feet", "level", "root", "start", "set_range"):
        layout.prop(own, name)
    if card.cyclic:
        layout.prop(own, "loop")
    layout.operator("posefield.import_clip", icon="IMPORT")
    layout.prop(own, "live")
    if card.walks:
        row = layout.row(align=True)
        row.prop(own, "count")
        row.prop(own, "seconds")
        layout.operator("posefield.import_crowd", icon="COMMUNITY")


def draw_text(layout, text: str, icon: str) -> None:
    """Draw a sentence, wrapped to several rows."""
    column = layout.column(align=True)
    column.alert = icon in ("ERROR", "CANCEL")
    for index, line in enumerate(textwrap.wrap(text, WIDTH)):
        column.label(text=line, icon="BLANK1" if index else icon)


CLASSES = (VIEW3D_PT_posefield,)
