"""Settings of the label sets of the picked model: a name, weights of several names, or none."""

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, StringProperty

from . import live, session
from .without_blender import label_choice
from .without_blender.cards import Card
from .without_blender.label_choice import PERFORMER, LabelValue

# Names of labels have no colons.
OPEN, MIXTURE = ":OPEN", ":MIXTURE"

# Blender keeps no reference to the strings of dynamic enum items, so they are kept here.
_kept: dict[str, list[tuple[str, str, str]]] = {}


def _names(own) -> tuple[str, ...]:
    card = session.current.card
    return next((each.names for each in card.labels if each.name == own.name), ()) if card else ()


def _choices(own, _context):
    known = _names(own)
    found = [(OPEN, "Unknown", f"Leave the {own.name} open")]
    found += [(MIXTURE, "Mixture", "Weights of several names")]
    found += [(name, name, f"{own.name}: {name}") for name in known]
    if own.label and own.label not in known:
        found.append((own.label, own.label, "Not known to this model"))
    _kept[own.name] = found
    return found


def _get_choice(own):
    chosen = MIXTURE if own.mixed else own.label or OPEN
    return [each[0] for each in _choices(own, None)].index(chosen)


def _set_choice(own, place):
    chosen = _choices(own, None)[place][0]
    own.mixed = chosen == MIXTURE
    own.label = "" if chosen in (OPEN, MIXTURE) else chosen


def _changed(own, _context):
    live.changed(own.id_data)


class PosefieldLabelWeight(bpy.types.PropertyGroup):
    """Weight of one name in a mixture; `name` is that name."""

    weight: FloatProperty(
        name="Weight",
        description="Share of this name; what all weights leave of 1 is left open",
        min=0.0,
        max=1.0,
        precision=3,
        update=_changed,
    )


class PosefieldLabelChoice(bpy.types.PropertyGroup):
    """Choice in one label set; `name` is the set's."""

    label: StringProperty(options={"HIDDEN"})
    mixed: BoolProperty(options={"HIDDEN"})
    choice: EnumProperty(
        name="Label",
        description="Name in the label set, weights of several, or unknown",
        items=_choices,
        get=_get_choice,
        set=_set_choice,
        update=_changed,
    )
    weights: CollectionProperty(type=PosefieldLabelWeight)

    @property
    def value(self) -> LabelValue | None:
        """Return the chosen name or weights; None if the set is left open."""
        if self.mixed:
            return label_choice.weights({each.name: each.weight for each in self.weights})
        return self.label or None


def make(own, card: Card, fresh: bool) -> None:
    """Make a choice for each label set of a card.

    fresh: leave all sets open, and forget weights; otherwise choices in sets of the same name are
    kept, also of sets and names that the card no longer has, which the service then refuses.
    """
    if fresh:
        own.labels.clear()
        own.performer_name = ""
    known = {each.name: each.names for each in card.labels}
    _drop(
        own.labels, [each.name for each in own.labels if each.name not in known and not each.value]
    )
    for name, names in known.items():
        choice = own.labels.get(name) or _add(own.labels, name)
        gone = [each.name for each in choice.weights if not each.weight and each.name not in names]
        _drop(choice.weights, gone)
        for label in names:
            if label not in choice.weights:
                _add(choice.weights, label)
    _take_performer(own)


def put(own, labels: dict[str, LabelValue | None]) -> None:
    """Choose names or weights, by label set; None leaves a set open."""
    for name, value in labels.items():
        choice = own.labels[name]
        choice.mixed = isinstance(value, dict)
        choice.label = value if isinstance(value, str) else ""
        if isinstance(value, dict):
            for label in value:
                if label not in choice.weights:
                    _add(choice.weights, label)
            for each in choice.weights:
                each.weight = value.get(each.name, 0.0)


def values(own) -> dict[str, LabelValue]:
    """Return the chosen names and weights, by label set; open sets are left out."""
    found = {each.name: each.value for each in own.labels}
    return {name: value for name, value in found.items() if value is not None}


def _take_performer(own) -> None:
    """Choose the performer of a file that an add-on without label sets has saved."""
    if own.performer_name and PERFORMER in own.labels:
        own.labels[PERFORMER].label = own.performer_name
        own.performer_name = ""


def _add(collection, name: str):
    made = collection.add()
    made.name = name
    return made


def _drop(collection, names: list[str]) -> None:
    for name in names:
        collection.remove(collection.find(name))


CLASSES = (PosefieldLabelWeight, PosefieldLabelChoice)
