"""Settings of the panel, stored with each scene."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import label_sets, live, questions, session
from .without_blender.variation import FEET, LARGEST_HEIGHT, LARGEST_SEED, VARIETY

# Blender keeps no reference to the strings of dynamic enum items, so they are kept here.
_kept: dict[str, list[tuple[str, str, str]]] = {}


def _items(kind: str, made: list[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    _kept[kind] = made
    return made


def _models(own, _context):
    found = [(name, name, description) for name, description in session.current.models]
    if not own.model_name:
        found.append(("NONE", "(refresh first)", ""))
    elif all(name != own.model_name for name, _, _ in found):
        # The file's model is shown even if the service no longer has it.
        found.append((own.model_name, own.model_name, "Not known: refresh"))
    return _items("models", found)


def _levels(own, _context):
    card = session.current.card
    errors = card.errors if card else ()
    found = [
        (str(level), f"{level}: off by {100 * error:.1f} cm", "Root mean square over joints")
        for level, error in enumerate(errors)
    ]
    more = range(len(errors), own.level_number + 1)
    return _items("levels", found + [(str(level), str(level), "") for level in more])


FEET_ITEMS = [
    (FEET[0], "As the model", "Stand, if the character travels and the model knows its contacts"),
    (FEET[1], "Stand", "Feet keep their places while they stand, and legs follow"),
    (FEET[2], "As predicted", "The prediction, unchanged"),
]


def _place(items, identifier: str) -> int:
    return [each[0] for each in items].index(identifier)


def _get_model(own):
    return _place(_models(own, None), own.model_name or "NONE")


def _set_model(own, place):
    name = _models(own, None)[place][0]
    own.model_name = "" if name == "NONE" else name


def _get_level(own):
    return own.level_number


def _set_level(own, place):
    own.level_number = place


def _picked(own, context):
    questions.pick(context, own.id_data)


def _changed(own, _context):
    live.changed(own.id_data)


def _is_armature(_own, found):
    return found.type == "ARMATURE"


class PosefieldSettings(bpy.types.PropertyGroup):
    """Model, request settings, and imported armature of a scene."""

    model_name: StringProperty(options={"HIDDEN"})
    performer_name: StringProperty(
        description="Performer in a file of an add-on without label sets", options={"HIDDEN"}
    )
    level_number: IntProperty(min=0, options={"HIDDEN"})
    sliders_of: StringProperty(
        description="Model that the controls' values belong to", options={"HIDDEN"}
    )

    model: EnumProperty(
        name="Model",
        description="What moves, of the models that the service has",
        items=_models,
        get=_get_model,
        set=_set_model,
        update=_picked,
    )
    labels: CollectionProperty(type=label_sets.PosefieldLabelChoice)
    level: EnumProperty(
        name="Detail",
        description="Level of detail; 0 is the finest",
        items=_levels,
        get=_get_level,
        set=_set_level,
        update=_changed,
    )
    root: EnumProperty(
        name="Root",
        description="Whether the character travels",
        items=[
            ("travelling", "Travelling", "The root goes where it went"),
            ("in_place", "In place", "The way is taken out, heights stay"),
        ],
        update=_changed,
    )
    loop: BoolProperty(
        name="Loop",
        description="One whole cycle that ends as it began, repeated by Cycles modifiers",
        update=_changed,
    )
    take: IntProperty(
        name="Take",
        description="Seed of another take of the motion; 0 is the prediction",
        min=0,
        max=LARGEST_SEED,
        update=_changed,
    )
    variety: FloatProperty(
        name="Variety",
        description="Size of a take's deviations; 1 is that of captured clips",
        default=VARIETY,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    detail: BoolProperty(
        name="Sampled detail",
        description="Add details that no control predicts, sampled by the take's seed",
        update=_changed,
    )
    feet: EnumProperty(
        name="Feet",
        description="Whether feet stand where they contact the ground",
        items=FEET_ITEMS,
        update=_changed,
    )
    floor: FloatProperty(
        name="Floor",
        description="Height of the floor on which feet stand, m",
        min=-LARGEST_HEIGHT,
        max=LARGEST_HEIGHT,
        precision=3,
        update=_changed,
    )
    rate: EnumProperty(
        name="Rate",
        description="Frames a second that are asked for",
        items=[
            ("SCENE", "As the scene", "The scene's frames a second"),
            ("OWN", "Own", "Another number"),
        ],
        update=_changed,
    )
    fps: FloatProperty(
        name="Frames a second",
        description="Keys a second of the clip",
        default=30.0,
        min=1.0,
        max=1000.0,
        update=_changed,
    )
    start: IntProperty(
        name="First frame",
        description="Frame of the scene at which the clip begins",
        default=1,
        min=0,
        max=500_000,
        update=_changed,
    )
    set_scene: BoolProperty(
        name="Set scene rate and range",
        description="The scene plays the clip as fast as it is, and from end to end",
        default=True,
    )
    script: PointerProperty(
        name="Script",
        description="Text block with the script of a performance, in JSON",
        type=bpy.types.Text,
    )
    live: BoolProperty(
        name="Update in place as sliders move",
        description="The imported clip follows the controls",
        update=_changed,
    )
    character: PointerProperty(
        name="Armature",
        description="The armature that the clip was imported on",
        type=bpy.types.Object,
        poll=_is_armature,
    )


CLASSES = (PosefieldSettings,)


def register(classes) -> None:
    """Register the add-on's classes and the settings of scenes."""
    for each in classes:
        bpy.utils.register_class(each)
    bpy.types.Scene.posefield = PointerProperty(type=PosefieldSettings)


def unregister(classes) -> None:
    """Unregister the add-on's classes; the data of scenes stay in their files."""
    del bpy.types.Scene.posefield
    for each in reversed(classes):
        bpy.utils.unregister_class(each)
