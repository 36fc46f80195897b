"""Operators of the panel's buttons, also for scripts: `bpy.ops.posefield`."""

import urllib.parse

import bpy
from bpy.props import StringProperty

from . import live, settings, state
from . import scene as scenes
from .without_blender import card as cards
from .without_blender.service import Fault

MARK = "posefield_script"
"""Property of an armature: name of the text block that was performed on it last."""


class _Operator:
    """Base of operators: a Fault is reported and shown in the panel."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context):
        """Run the operator; on an error nothing changes."""
        try:
            sentences = self.run(context.scene)
        except Fault as fault:
            state.current.tell(str(fault), failed=True)
            self.report({"ERROR"}, str(fault))
            return {"CANCELLED"}
        state.current.tell(*sentences)
        for sentence in sentences:
            self.report({"INFO"}, sentence)
        return {"FINISHED"}


class POSEFIELD_OT_refresh(_Operator, bpy.types.Operator):
    """Ask the service which models it has, and for the picked one's controls"""

    bl_idname = "posefield.refresh"
    bl_label = "Refresh"
    bl_options = {"REGISTER"}  # noqa: RUF012

    def run(self, scene) -> list[str]:
        """Fetch models and card again."""
        settings.refresh(scene)
        return []


class POSEFIELD_OT_reset(_Operator, bpy.types.Operator):
    """Set all controls to their defaults"""

    bl_idname = "posefield.reset"
    bl_label = "Reset controls"

    def run(self, scene) -> list[str]:
        """Set every slider to its default."""
        settings.reset(scene)
        return []


class POSEFIELD_OT_import_clip(_Operator, bpy.types.Operator):
    """Import the clip at these controls as a character"""

    bl_idname = "posefield.import_clip"
    bl_label = "Import clip"

    model: StringProperty(name="Model", description="Name of a model; the panel's, if empty")
    controls: StringProperty(
        name="Controls",
        description="JSON object of values by control; the panel's for those it leaves out",
    )
    labels: StringProperty(
        name="Labels",
        description="JSON object of a name or weights by name, by label set; the panel's for those "
        "it leaves out",
    )

    def run(self, scene) -> list[str]:
        """Fetch the clip, and only then change the scene."""
        if state.current.card is None:
            settings.refresh(scene)
        if self.model and self.model != scene.posefield.model:
            settings.take(scene, cards.fetch(settings.service(), self.model))
        card, question = settings.card_of(scene), settings.question(scene)
        known = {control.name: control for control in card.controls}
        question["controls"] |= cards.values_of_json(self.controls, known, "control")
        question["labels"] |= cards.values_of_json(self.labels, card.labels, "label set")
        answer = settings.service().fetch(f"{cards.path(card.identity)}/clip.glb", question)
        return live.put_clip(scene, answer, question["loop"], card.name)


class POSEFIELD_OT_import_crowd(_Operator, bpy.types.Operator):
    """Import a crowd that walks, of a model of a gait"""

    bl_idname = "posefield.import_crowd"
    bl_label = "Import crowd"

    def run(self, scene) -> list[str]:
        """Fetch the crowd as USD and import it into a collection."""
        own, card = scene.posefield, settings.card_of(scene)
        if not card.walks:
            raise Fault(f"{card.name} is no gait that travels, expected one for a crowd")
        query = {"count": own.count, "seconds": own.seconds, "fps": settings.rate(scene)}
        query |= {"seed": own.take} if own.take else {}
        path = f"{cards.path(card.identity)}/crowd.usdc?{urllib.parse.urlencode(query)}"
        answer = settings.service().fetch(path)
        count = scenes.import_crowd(answer.content, f"{card.name} crowd")
        return [f"{count} characters", *answer.sentences]


class POSEFIELD_OT_perform_script(_Operator, bpy.types.Operator):
    """Import the performance of a script as a character, with markers at its segments"""

    bl_idname = "posefield.perform_script"
    bl_label = "Perform script"

    text: StringProperty(name="Text", description="Name of the text block; the panel's, if empty")

    def run(self, scene) -> list[str]:
        """Fetch the performance and its report, and only then change the scene."""
        text, own = self._text(scene), scene.posefield
        service, fps = settings.service(), settings.rate(scene)
        script = {"fps": fps} | cards.json_object(text.as_string(), text.name)
        report = service.fetch("/v1/performances.json?plan=true", script).document["trust"]
        answer = service.fetch("/v1/performances.glb", script)
        performers = (each for each in scene.objects if each.get(MARK) == text.name)
        armature = scenes.import_character(
            answer.content, text.name, own.start, next(performers, None)
        )
        armature[MARK] = text.name
        moments = [
            (round(own.start + fps * each["begins"]), f"{index} {each['kind']}")
            for index, each in enumerate(report["segments"])
        ]
        scenes.put_markers(scene, text.name, moments)
        said = []
        if own.set_range:
            said = scenes.set_range(scene, own.start, scenes.last_frame(armature))
        warnings = [f"{each['pointer']}: {each['message']}" for each in report["warnings"]]
        return [*answer.sentences[:1], *warnings, *said]

    def _text(self, scene):
        text = bpy.data.texts.get(self.text) if self.text else scene.posefield.script
        if text is None:
            known = ", ".join(bpy.data.texts.keys()) or "none"
            raise Fault(f"no text block {self.text!r}, expected one of {known}")
        return text


CLASSES = (
    POSEFIELD_OT_refresh,
    POSEFIELD_OT_reset,
    POSEFIELD_OT_import_clip,
    POSEFIELD_OT_import_crowd,
    POSEFIELD_OT_perform_script,
)
