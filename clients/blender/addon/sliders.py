"""Sliders for the controls of the picked model, made from its card."""

import bpy
from bpy.props import FloatProperty, PointerProperty

from . import live
from .without_blender.cards import Card, Control

PLACE = "posefield_controls"
"""Scene property that holds the sliders."""


def make(card: Card) -> None:
    """Replace the sliders by those of a card; values of the same name are kept."""
    remove()
    own = {attribute(each): _slider(each) for each in card.controls}
    made = type("PosefieldControls", (bpy.types.PropertyGroup,), {"__annotations__": own})
    bpy.utils.register_class(made)
    setattr(bpy.types.Scene, PLACE, PointerProperty(type=made))


def remove() -> None:
    """Remove the sliders."""
    if hasattr(bpy.types.Scene, PLACE):
        made = bpy.types.Scene.bl_rna.properties[PLACE].fixed_type
        delattr(bpy.types.Scene, PLACE)
        bpy.utils.unregister_class(bpy.types.PropertyGroup.bl_rna_get_subclass_py(made.identifier))


def reset(scene, card: Card) -> None:
    """Set every slider to its control's default."""
    put(scene, card, card.defaults)


def put(scene, card: Card, values: dict[str, float]) -> None:
    """Set some sliders to values, by control."""
    for control in card.controls:
        if control.name in values:
            setattr(getattr(scene, PLACE), attribute(control), values[control.name])


def values(scene, card: Card) -> dict[str, float]:
    """Return the values of the sliders, by control."""
    own = getattr(scene, PLACE)
    return {each.name: each.exact(getattr(own, attribute(each))) for each in card.controls}


def attribute(control: Control) -> str:
    """Return the attribute name of a slider; Blender reserves some names."""
    taken = hasattr(bpy.types.PropertyGroup, control.name)
    return f"{control.name}_" if taken else control.name


def _slider(control: Control):
    lowest, highest = control.limits
    return FloatProperty(
        name=f"{control.name} ({control.unit})",
        description=f"{control.description}; sampled: {control.sampled}",
        default=control.default,
        min=lowest,
        max=highest,
        soft_min=control.minimum,
        soft_max=control.maximum,
        precision=3,
        update=_changed,
    )


def _changed(own, _context) -> None:
    live.changed(own.id_data)
