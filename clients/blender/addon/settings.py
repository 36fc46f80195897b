"""Settings: of the service in Blender's preferences, of questions in each scene."""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import live, state
from .without_blender import card as cards
from .without_blender.card import Card
from .without_blender.service import Fault, Service

CONTROLS = "posefield_controls"
"""Scene property with the sliders and labels of the picked model."""
OPEN = ":open"
"""Choice of a label set that leaves it open."""


class PosefieldPreferences(bpy.types.AddonPreferences):
    """Address, key and timeout of the service."""

    bl_idname = __package__

    address: StringProperty(
        name="Service",
        description="Address of the posefield service",
        default="http://127.0.0.1:8000",
    )
    key: StringProperty(
        name="API key",
        description="Sent with every question, where the service asks for one",
        subtype="PASSWORD",
    )
    seconds: FloatProperty(
        name="Timeout",
        description="How long an answer may take, s",
        default=5.0,
        min=0.1,
        soft_max=60.0,
    )

    def draw(self, _context):
        """Draw the settings, with warnings on the storage and transport of the key."""
        for name in ("address", "key", "seconds"):
            self.layout.prop(self, name)
        if self.key:
            stored = "The key is kept as plain text in Blender's preferences"
            self.layout.label(text=stored, icon="INFO")
            if not _is_secret(self.address):
                unsafe = "Without https others on the way can read the key"
                self.layout.label(text=unsafe, icon="ERROR")


def service() -> Service:
    """Return the service; raise Fault for a wrong address, or if Blender may not access it."""
    own = bpy.context.preferences.addons[__package__].preferences
    named = Service(own.address, own.key, own.seconds)
    if not named.is_here and not bpy.app.online_access:
        raise Fault(
            f"{own.address} is another machine, and Blender is set to stay offline:"
            " Preferences, System, Allow Online Access"
        )
    return named


def _is_secret(address: str) -> bool:
    try:
        return Service(address).is_secret
    except Fault:
        return True


def _names(_settings, _context, typed):
    return [name for name, _ in state.current.models if typed.lower() in name]


def _picked(own, _context):
    if state.current.taking:
        return
    try:
        take(own.id_data, cards.fetch(service(), own.model))
        state.current.tell()
    except Fault as fault:
        state.current.card = None
        state.current.tell(str(fault), failed=True)


def _changed(own, _context):
    live.changed(own.id_data)


def _is_armature(_own, candidate):
    return candidate.type == "ARMATURE"


class PosefieldSettings(bpy.types.PropertyGroup):
    """Model, request settings, and imported armature of a scene."""

    sliders_of: StringProperty(description="Model of the sliders' values", options={"HIDDEN"})
    model: StringProperty(
        name="Model",
        description="What moves, of the models that the service has",
        search=_names,
        search_options={"SORT"},
        update=_picked,
    )
    level: IntProperty(
        name="Detail",
        description="Level of detail; 0 is the finest",
        min=0,
        max=9,
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
        max=999_999_999,
        update=_changed,
    )
    variety: FloatProperty(
        name="Variety",
        description="Size of a take's deviations; 1 is that of captured clips",
        default=0.7,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    feet: EnumProperty(
        name="Feet",
        description="Whether feet stand where they contact the ground",
        items=[
            ("default", "As the model", "Stand, if the model knows the contacts of its feet"),
            ("stand", "Stand", "Feet keep their places while they stand, and legs follow"),
            ("as_predicted", "As predicted", "The prediction, unchanged"),
        ],
        update=_changed,
    )
    start: IntProperty(
        name="First frame",
        description="Frame of the scene at which motions begin",
        default=1,
        min=0,
        max=500_000,
        update=_changed,
    )
    set_range: BoolProperty(
        name="Set scene range",
        description="The scene plays from the first frame of the motion to its last",
        default=True,
    )
    count: IntProperty(name="Characters", description="Of a crowd", default=10, min=1, max=1000)
    seconds: FloatProperty(
        name="Seconds", description="Duration of a crowd", default=4.0, min=0.1, max=600.0
    )
    script: PointerProperty(
        name="Script",
        description="Text block with the script of a performance, in JSON",
        type=bpy.types.Text,
    )
    live: BoolProperty(
        name="Update as sliders move",
        description="The imported clip is imported again when a setting changes",
        update=_changed,
    )
    character: PointerProperty(
        name="Armature",
        description="Armature of the imported clip",
        type=bpy.types.Object,
        poll=_is_armature,
    )


def refresh(scene) -> None:
    """Fetch the list of models, and the card of the picked one, or of the first."""
    models = cards.models(service())
    if not models:
        raise Fault("the service has no models")
    names = [name for name, _ in models]
    own = scene.posefield
    card = cards.fetch(service(), own.model if own.model in names else names[0])
    state.current.models = models
    take(scene, card)


def take(scene, card: Card) -> None:
    """Make the sliders of a card, at their defaults unless the scene already used this model."""
    own = scene.posefield
    state.current.card = card
    make_controls(card)
    fresh = own.sliders_of != card.name
    state.current.taking = True
    try:
        own.model = own.sliders_of = card.name
        if fresh:
            own.level, own.take, own.loop, own.feet = 0, 0, False, "default"
            reset(scene)
    finally:
        state.current.taking = False


def card_of(scene) -> Card:
    """Return the card of the scene's model; raise Fault if it is unknown."""
    card = state.current.card
    if card is None or scene.posefield.model not in (card.name, card.identity):
        raise Fault("no model is picked: refresh, and pick one")
    return card


def make_controls(card: Card) -> None:
    """Replace the sliders by those of a card; values of the same name are kept."""
    remove_controls()
    own = {attribute(each.name): _slider(each) for each in card.controls}
    for name, labels in card.labels.items():
        own[_label_attribute(name)] = EnumProperty(
            name=name.capitalize(),
            items=[(OPEN, "Unknown", ""), *((label, label, "") for label in labels)],
            update=_changed,
        )
    made = type("PosefieldControls", (bpy.types.PropertyGroup,), {"__annotations__": own})
    bpy.utils.register_class(made)
    setattr(bpy.types.Scene, CONTROLS, PointerProperty(type=made))


def remove_controls() -> None:
    """Remove the sliders."""
    if hasattr(bpy.types.Scene, CONTROLS):
        made = bpy.types.Scene.bl_rna.properties[CONTROLS].fixed_type
        delattr(bpy.types.Scene, CONTROLS)
        bpy.utils.unregister_class(bpy.types.PropertyGroup.bl_rna_get_subclass_py(made.identifier))


def reset(scene) -> None:
    """Set every slider to its default, and leave every label set open."""
    card, sliders = card_of(scene), getattr(scene, CONTROLS)
    for control in card.controls:
        setattr(sliders, attribute(control.name), control.default)
    for name in card.labels:
        setattr(sliders, _label_attribute(name), OPEN)


def controls(scene, card: Card) -> dict[str, float]:
    """Return the values of the sliders, by control."""
    sliders = getattr(scene, CONTROLS)
    return {each.name: each.exact(getattr(sliders, attribute(each.name))) for each in card.controls}


def labels(scene, card: Card) -> dict[str, str]:
    """Return the chosen names, by label set; open sets are left out."""
    sliders = getattr(scene, CONTROLS)
    chosen = {name: getattr(sliders, _label_attribute(name)) for name in card.labels}
    return {name: label for name, label in chosen.items() if label != OPEN}


def question(scene) -> dict[str, object]:
    """Return the panel's request for a clip as the service's JSON."""
    own, card = scene.posefield, card_of(scene)
    asked = {
        "controls": controls(scene, card),
        "labels": labels(scene, card),
        "fps": rate(scene),
        "level": own.level,
        "root": own.root,
        "loop": own.loop,
    }
    if own.take:
        asked |= {"take": own.take, "variety": cards.shortest(own.variety)}
    if own.feet != "default":
        asked["feet"] = own.feet
    return asked


def rate(scene) -> float:
    """Return the frames per second of a scene."""
    return scene.render.fps / cards.shortest(scene.render.fps_base)


def attribute(name: str) -> str:
    """Return the attribute name of a slider; Blender reserves some names."""
    return f"{name}_" if hasattr(bpy.types.PropertyGroup, name) else name


def _label_attribute(name: str) -> str:
    return f"label_{name}"


def _slider(control):
    return FloatProperty(
        name=f"{control.name} ({control.unit})",
        description=f"{control.description}; sampled: {control.sampled}",
        default=control.default,
        soft_min=control.minimum,
        soft_max=control.maximum,
        precision=3,
        update=_changed,
    )


CLASSES = (PosefieldPreferences, PosefieldSettings)
