"""Checks between the sections of a recipe; each raises KeyFault with the key at fault."""

from collections.abc import Collection, Iterator, Mapping, Sequence

from posefield.common.errors import did_you_mean
from posefield.motion import measures
from posefield_train.source.control_sources import RESERVED, TIME_NAMES, Auto, Control, KeyFault
from posefield_train.source.recipe_sections import (
    PERFORMER,
    Clips,
    Event,
    Kriging,
    Motion,
    Preset,
    Size,
    SkeletonSettings,
)

# Quantities that only a whole cycle has.
CYCLE_QUANTITIES = (*measures.TRAVEL_QUANTITIES, "step_length")


def check_skeleton(skeleton: SkeletonSettings, roles: Collection[str]) -> None:
    """Raise KeyFault for roles that the topology does not use."""
    if skeleton.is_unified and roles:
        raise KeyFault(
            "found roles and skeleton.topology = 'roles', whose joints are named by their roles, "
            "expected those of the files as [skeleton.roles], if any",
            "roles",
        )
    if not skeleton.is_unified and skeleton.roles:
        raise KeyFault(
            "found roles and skeleton.topology = 'files', expected topology = 'roles', or the "
            "joints as [roles]",
            *("skeleton", "roles"),
        )


def check_label_sets(clips: Clips, kriging: Kriging) -> None:
    """Raise KeyFault for a label set without a column, and for a column that no set uses."""
    if PERFORMER in clips.labels:
        raise KeyFault(
            "found 'performer', whose column is clips.performer", "clips", "labels", PERFORMER
        )
    for name in kriging.label:
        if name == PERFORMER and not clips.performer:
            raise KeyFault(
                "found 'performer', but clips.performer names no column", "kriging", "label"
            )
        if name != PERFORMER and name not in clips.labels:
            known = (PERFORMER, *clips.labels)
            raise KeyFault(
                f"found {name!r}{did_you_mean(name, known)}, expected 'performer' or a name of "
                f"clips.labels {[*clips.labels]}",
                *("kriging", "label"),
            )
    unused = [name for name in clips.labels if name not in kriging.label]
    if unused:
        raise KeyFault(
            f"found {unused[0]!r}, which kriging.label does not name, expected it there",
            *("clips", "labels", unused[0]),
        )


def check_label_names(controls: Sequence[Control], kriging: Kriging) -> None:
    """Raise KeyFault for a label set with the name of a control or of a request's parameter."""
    names = [control.name for control in controls]
    for name in kriging.label:
        if name in names:
            raise KeyFault(
                f"found {name!r}, which is a control, too, expected another name",
                *("kriging", "label"),
            )
        if name in RESERVED - {PERFORMER}:
            raise KeyFault(
                f"found {name!r}, which is a parameter of requests, expected another name",
                *("kriging", "label"),
            )


def check_presets(
    presets: Mapping[str, Preset], controls: Sequence[Control], kriging: Kriging
) -> None:
    """Raise KeyFault for a preset with other controls, and for one with an unknown label set."""
    names = [control.name for control in controls]
    for name, preset in presets.items():
        if sorted(preset.values) != sorted(names):
            found = ", ".join(preset.values) or "nothing"
            raise KeyFault(f"found {found}, expected a value for each of {names}", "presets", name)
        for label_set, label in preset.labels.items():
            if label_set not in kriging.label:
                raise KeyFault(
                    f"found {label!r} and no kriging.label {label_set!r}"
                    f"{did_you_mean(label_set, kriging.label)}, expected kriging.label = "
                    f"{label_set!r}",
                    *("presets", name),
                    *((PERFORMER,) if label_set == PERFORMER else ("labels", label_set)),
                )


def measurement_faults(
    auto: Auto, motion: Motion, landmarks: list[str], leg_ends: Sequence[str]
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the reasons for which a quantity cannot be measured, each with its key.

    leg_ends: joints of a step or a leg, if the quantity is measured between two.
    """
    quantity = auto.quantity
    if quantity in CYCLE_QUANTITIES and not motion.cyclic:
        yield (
            ("auto", "quantity"),
            f"found {quantity!r} and motion.cyclic = false, expected a cycle: of a motion that "
            "ends elsewhere it depends on the cut",
        )
    if quantity in ("speed", "stride_length") and motion.root == "in_place":
        found = f"found {quantity!r} and motion.root = 'in_place', expected one that travels"
        yield ("auto", "quantity"), found
    if auto.at is not None and (fault := _moment_fault(auto.at, landmarks)):
        yield ("auto", "at"), fault
    if quantity == "step_length" and len(leg_ends) != 2:
        found = f"found none and motion.feet {motion.feet}, expected two feet"
        yield ("auto", "joints"), found
    if quantity == "leg_length" and len(leg_ends) != 2:
        yield (
            ("auto", "joints"),
            "found none, and not both roles leftUpperLeg and leftFoot; expected the upper end "
            "of a leg and its lower",
        )


def check_event(event: Event | None, size: Size, landmarks: list[str]) -> None:
    """Raise KeyFault for an unknown moment of the event, and for its budget without an event."""
    if event is None:
        if size.effector_budget_cm is not None:
            raise KeyFault(
                f"found {size.effector_budget_cm:g} and no [event], expected event.joint "
                "and event.at to say where it counts",
                *("size", "effector_budget_cm"),
            )
    elif fault := _moment_fault(event.at, landmarks):
        raise KeyFault(fault, "event", "at")


def check_landmarks(landmarks: Sequence[str]) -> None:
    """Raise KeyFault for a landmark with the name of a moment that is found in the motion."""
    for index, name in enumerate(landmarks):
        if name in TIME_NAMES:
            raise KeyFault(
                f"found {name!r}, a moment that is found in the motion, expected a column of "
                "another name",
                *("clips", "landmarks", index),
            )


def _moment_fault(at: str, landmarks: list[str]) -> str | None:
    """Return the fault of an unknown moment; None for a known one."""
    known = (*TIME_NAMES, *landmarks)
    if at in known:
        return None
    moments = ", ".join(map(repr, TIME_NAMES))
    expected = f"expected {moments} or a column of clips.landmarks {landmarks}"
    return f"found {at!r}{did_you_mean(at, known)}, {expected}"
