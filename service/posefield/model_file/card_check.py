"""Consistency of a model card: with itself, and with the graph that it describes.

A model whose card passes answers every valid question: lengths agree, indices are in range, and
divisors are not zero.
"""

import struct
from collections import Counter
from collections.abc import Collection, Hashable, Iterable, Mapping, Sized
from itertools import pairwise

import numpy as np

from posefield.kriging.kriging_model import COVARIANCE_MODELS
from posefield.model_file.model_card import ROW_VALUES, ModelCard
from posefield.motion.joint_roles import ROLES
from posefield.motion.measures import POSITION_AXES, TRAVEL_QUANTITIES, Measure
from posefield.robots import robot_clip

MAX_ENTRIES = {"controls": 64, "levels": 16, "skeleton": 4096}
"""Largest number of entries of lists that need at least one."""
DURATION_RANGE = 1e-3, 1e4
"""Shortest and longest clip, s."""
MAX_LENGTH = 1e3
"""Longest bone, m, and largest entry of `beside`."""
HALF_BYTES = 2
"""Bytes of a number in half precision."""
CYCLE_VARIABLES = 4
MAX_SPREAD = 10.0
"""Largest standard deviation of the logarithm of a duration."""
"""Rows and columns of a cycle's `beside`: logarithm of the duration, and travel."""
MAX_SHOWN = 60
"""Largest number of characters of a value in a message."""

MAX_CURVES = 1_000
"""Largest number of curves; a face has about fifty."""
UNIT_TOLERANCE = 1e-3
ANY_SIZE = -1
"""A size that the card does not determine."""
REQUIRED_VALUES = ("coefficients", "frame")
"""Values inside the graph that corrections start from; a cyclic model has `way` as well, and one
with contacts `contacts`.
"""


def check(card: ModelCard) -> None:
    """Raise ValueError for a card that contradicts itself.

    The message names path, value and expectation.
    """
    for name, largest in MAX_ENTRIES.items():
        count = len(getattr(card, name))
        _expect(1 <= count <= largest, name, count, f"1 to {largest}")
    _check_lengths(card)
    _check_controls(card)
    _check_clips(card)
    _check_kriging(card)
    _check_skeleton(card)
    _check_levels(card)
    _check_training_parameters(card)
    _check_presets(card)
    _check_curves(card)
    _check_contacts(card)
    _check_accelerations(card)
    _check_hinges(card)
    _check_robot(card)


def check_graph(
    card: ModelCard, shapes: Mapping[str, tuple[int, ...]], values: Collection[str]
) -> None:
    """Raise ValueError where the card does not describe the graph with these constants and values.

    shapes: shapes of the graph's constants by name. values: names of the values that its nodes
    compute.
    """
    for name, expected in _shapes(card).items():
        shape = shapes.get(name, ())
        fits = [b in (a, ANY_SIZE) for a, b in zip(shape, expected, strict=False)]
        if len(shape) != len(expected) or not all(fits):
            card_shape = str(expected).replace(str(ANY_SIZE), "any")
            raise ValueError(
                f"its graph's constant {name!r} has shape {shape}, "
                f"expected {card_shape} by its card"
            )
    further = [*["way"] * card.cyclic, *["contacts"] * bool(card.contacts)]
    further += [rows for name, rows in ROW_VALUES.items() if card.curves or name != "curves"]
    for name in (*REQUIRED_VALUES, *further):
        if name not in values:
            raise ValueError(f"its graph computes no value {name!r}, expected one")


def _expect(right: bool, path: str, value: object, expected: str) -> None:
    if not right:
        text = str(value)
        shortened = text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}…"
        raise ValueError(f"its card's {path} is {shortened}, expected {expected}")


def _expect_length(values: Sized, path: str, expected: int) -> None:
    if len(values) != expected:
        raise ValueError(f"its card's {path} has {len(values)} entries, expected {expected}")


def _expect_unique(values: Iterable[Hashable], path: str) -> None:
    twice = [entry for entry, count in Counter(values).items() if count > 1]
    _expect(not twice, path, twice, "each entry once")


def _expect_joints(joints: tuple[int, ...], path: str, card: ModelCard) -> None:
    last = len(card.skeleton) - 1
    _expect_unique(joints, path)
    _expect(max(joints, default=0) <= last, path, list(joints), f"joints from 0 to {last}")


def _check_lengths(card: ModelCard) -> None:
    """Check the lengths of lists that have an entry for each clip, joint or control."""
    clips, joints, controls = len(card.examples), len(card.skeleton), len(card.controls)
    _expect(clips > 0, "examples", [], "captured clips")
    size = CYCLE_VARIABLES if card.cyclic else 0
    rows: list[tuple[str, Sized, int]]
    rows = [(f"examples[{i}]", row, controls) for i, row in enumerate(card.examples)]
    rows += [(f"beside[{i}]", row, size) for i, row in enumerate(card.beside)]
    rows += [
        ("sources", card.sources, clips),
        ("left_out", card.left_out, clips),
        ("making.takes", card.making.takes, clips if card.making.takes else 0),
        ("joint_sigma", card.joint_sigma, joints),
        ("levels[0].joints", card.levels[0].joints, joints),
        ("kriging.scales", card.kriging.scales, controls),
        ("beside", card.beside, size),
        ("kriging.labels", card.kriging.labels, len(card.labels)),
    ]
    rows += [(f"labels[{i}].clips", label.clips, clips) for i, label in enumerate(card.labels)]
    for path, values, expected in rows:
        _expect_length(values, path, expected)


def _check_controls(card: ModelCard) -> None:
    _expect_unique([control.name for control in card.controls], "controls")
    for index, control in enumerate(card.controls):
        path, sampled = f"controls[{index}]", sorted(example[index] for example in card.examples)
        low, high = sampled[0], sampled[-1]
        _expect(low < high, path, f"{low} in all clips", "a control that varies")
        limits = (control.minimum, control.maximum)
        _expect(limits == (low, high), path, limits, f"{low}, {high} by its clips")
        # Files of earlier versions have medians, which are values of clips, too.
        is_sampled = control.default in sampled
        _expect(is_sampled, f"{path}.default", control.default, "the value of one of its clips")
        is_complete = control.values in ((), tuple(sorted({*sampled})))
        _expect(is_complete, f"{path}.values", control.values, "those of its clips, or none")
        if control.measure:
            _check_measure(f"{path}.measure", control.measure, card)


def _check_measure(path: str, measure: Measure, card: ModelCard) -> None:
    _expect_joints(measure.joints, f"{path}.joints", card)
    count = len(measure.joints)
    if measure.quantity in POSITION_AXES:
        _expect(measure.at is not None, f"{path}.at", None, f"a moment of {measure.quantity}")
        _expect(count > 0, f"{path}.joints", [], f"joints of {measure.quantity}")
    if measure.quantity == "step_length":
        _expect_length(measure.joints, f"{path}.joints", 2)
    if measure.quantity == "leg_length":
        _expect(count > 0, f"{path}.joints", [], "the joints of a leg")
    if measure.at == "landmark":
        _expect(measure.share is not None, f"{path}.share", None, "the place of the landmark")
    of_cycles = measure.quantity in (*TRAVEL_QUANTITIES, "step_length")
    _expect(card.cyclic or not of_cycles, path, measure.quantity, "another, for it is of cycles")


def _check_clips(card: ModelCard) -> None:
    clips = len(card.examples)
    _expect(card.samples == clips, "samples", card.samples, f"{clips}, as many as examples")
    _check_labels(card)
    low, high = card.durations
    shortest, longest = DURATION_RANGE
    right = shortest <= low <= high <= longest
    _expect(right, "durations", [low, high], f"two in order, from {shortest} to {longest} s")
    tensor = card.diagnostics["tensor"]
    right = tuple(tensor[1:]) == (card.frames, card.samples)
    _expect(right, "diagnostics.tensor", tensor, f"{card.frames} frames and {clips} clips")


def _check_labels(card: ModelCard) -> None:
    controls = {control.name for control in card.controls}
    _expect_unique([label.name for label in card.labels], "labels")
    for index, (label, kernel) in enumerate(zip(card.labels, card.kriging.labels, strict=True)):
        path, count = f"labels[{index}]", len(label.names)
        _expect(label.name not in controls, f"{path}.name", label.name, "none of the controls")
        _expect_unique(label.names, f"{path}.names")
        _expect(count > 0, f"{path}.names", [], "names")
        last = max(label.clips, default=0)
        _expect(last < count, f"{path}.clips", last, f"indices below {count}")
        names, where = kernel.count, f"kriging.labels[{index}]"
        _expect(names == count, f"{where}.count", names, f"{count}, as many as {path}.names")
        correlation = kernel.correlation
        _expect(correlation <= 1.0, f"{where}.correlation", correlation, "at most 1")


def _check_kriging(card: ModelCard) -> None:
    kriging = card.kriging
    _expect(
        kriging.covariance in COVARIANCE_MODELS,
        "kriging.covariance",
        kriging.covariance,
        f"of {[*COVARIANCE_MODELS]}",
    )
    _expect(len(kriging.drifts) > 0, "kriging.drifts", [], "degrees")
    right = kriging.scales.ndim == 1 and bool((kriging.scales > 0.0).all())
    _expect(right, "kriging.scales", kriging.scales.tolist(), "numbers above 0")
    for index, row in enumerate(card.beside):
        right = max(map(abs, row)) <= MAX_LENGTH
        _expect(right, f"beside[{index}]", list(row), f"at most {MAX_LENGTH:g}")


def _check_skeleton(card: ModelCard) -> None:
    joints = card.skeleton
    for name, offsets in (("offsets", joints.offsets), ("tip_offsets", joints.tip_offsets)):
        longest = float(abs(offsets).max(initial=0.0))
        _expect(longest <= MAX_LENGTH, f"skeleton.{name}", longest, f"at most {MAX_LENGTH:g} m")
    _expect_joints(card.feet, "feet", card)
    _expect_joints((card.event.joint,) if card.event else (), "event.joint", card)
    for role, joint in card.roles.items():
        _expect(role in ROLES, "roles", role, "roles of a VRM humanoid")
        _expect(joint in joints.names, f"roles.{role}", joint, "a joint")
    _expect_unique(card.roles.values(), "roles")


def _check_levels(card: ModelCard) -> None:
    finest = card.levels[0]
    _expect(finest.samples == card.samples, "levels[0].samples", finest.samples, "all")
    _expect(card.frames > 1, "frames", card.frames, "2 or more")
    for index, level in enumerate(card.levels):
        _expect_joints(level.joints, f"levels[{index}].joints", card)
    for index, (finer, level) in enumerate(pairwise(card.levels), start=1):
        path, more = f"levels[{index}]", sorted({*level.joints} - {*finer.joints})
        _expect(not more, f"{path}.joints", more, "joints of the finer level")
        _expect(level.samples <= finer.samples, f"{path}.samples", level.samples, "no more")
        ranks = zip(level.ranks, finer.ranks, strict=True)
        _expect(all(a <= b for a, b in ranks), f"{path}.ranks", level.ranks, "no higher ones")


def _check_training_parameters(card: ModelCard) -> None:
    for name, values in card.making.fields.items():
        sets = len(card.labels)
        expected = f"a nugget, a trend and an offset for each of {sets} label sets"
        _expect(len(values) == 2 + sets, f"making.fields.{name}", list(values), expected)
    _check_take_statistics(card)
    for joint in card.making.joint_weights:
        _expect(joint in card.skeleton.names, "making.joint_weights", joint, "a joint")


def _check_take_statistics(card: ModelCard) -> None:
    """Check the statistics that takes are drawn from."""
    spread = card.making.repeat_duration
    right = spread <= (0.0 if card.cyclic else MAX_SPREAD)
    _expect(right, "making.repeat_duration", spread, f"at most {MAX_SPREAD:g}, and 0 for a cycle")
    root, stored = card.making.take_root, card.making.detail
    freedoms, _, modes = card.levels[0].ranks
    _expect(len(root) in (0, len(card.beside)), "making.take_root", len(root), "0 or 4 rows")
    for index, row in enumerate(root):
        path = f"making.take_root[{index}]"
        _expect_length(row, path, modes + CYCLE_VARIABLES)
        _expect(max(map(abs, row)) <= MAX_LENGTH, path, list(row), f"at most {MAX_LENGTH:g}")
    rows, rest = divmod(len(stored), HALF_BYTES * freedoms)
    _expect(rest == 0, "making.detail", len(stored), f"bytes of rows of {freedoms} numbers")
    right = rows == 0 or (bool(root) and rows < card.frames // 2)
    _expect(right, "making.detail", rows, "fewer harmonics than half the frames of a cycle")
    sizes = struct.unpack(f"<{rows * freedoms}e", stored)
    right = all(0.0 <= size <= MAX_LENGTH for size in sizes)
    _expect(right, "making.detail", "negative or too large", f"deviations from 0 to {MAX_LENGTH:g}")


def _check_presets(card: ModelCard) -> None:
    _expect_unique([preset.name for preset in card.presets], "presets")
    names = [control.name for control in card.controls]
    for index, preset in enumerate(card.presets):
        path = f"presets[{index}]"
        right = sorted(preset.controls) == sorted(names)
        _expect(right, f"{path}.controls", [*preset.controls], f"a value for each of {names}")
        for control in card.controls:
            value, low, high = preset.controls[control.name], control.minimum, control.maximum
            right = low <= value <= high
            _expect(right, f"{path}.controls.{control.name}", value, f"{low} to {high}")
        label_names = {card_label.name: card_label.names for card_label in card.labels}
        for label_set, label in preset.labels.items():
            _expect(
                label_set in label_names,
                f"{path}.labels",
                label_set,
                f"label sets {[*label_names]}",
            )
            right, expected = label in label_names[label_set], f"one of {[*label_names[label_set]]}"
            _expect(right, f"{path}.labels.{label_set}", label, expected)


def _check_curves(card: ModelCard) -> None:
    _expect_unique([curve.name for curve in card.curves], "curves")
    _expect(len(card.curves) <= MAX_CURVES, "curves", len(card.curves), f"at most {MAX_CURVES}")
    for index, curve in enumerate(card.curves):
        limits = [curve.minimum, curve.maximum]
        _expect(limits[0] < limits[1], f"curves[{index}]", limits, "a minimum below the maximum")


def _check_contacts(card: ModelCard) -> None:
    _expect_joints(tuple(contact.joint for contact in card.contacts), "contacts", card)
    for index, contact in enumerate(card.contacts):
        path, longest = f"contacts[{index}]", contact.longest_swing
        right = contact.swing <= longest
        _expect(right, f"{path}.longest_swing", longest, f"at least its swing, {contact.swing} s")
        for name, number in (("height", contact.height), ("clearance", contact.clearance)):
            _expect(
                abs(number) <= MAX_LENGTH, f"{path}.{name}", number, f"at most {MAX_LENGTH:g} m"
            )


def _check_accelerations(card: ModelCard) -> None:
    acceleration = card.captured_acceleration
    if acceleration is not None:
        path = "captured_acceleration.p99"
        _expect(
            acceleration.p99 >= acceleration.median,
            path,
            acceleration.p99,
            f"at least the median, {acceleration.median:g}",
        )


def _check_hinges(card: ModelCard) -> None:
    _expect_joints(tuple(hinge.joint for hinge in card.hinges), "hinges", card)
    for index, hinge in enumerate(card.hinges):
        path, axis, bone = f"hinges[{index}]", np.array(hinge.axis), np.array(hinge.bone)
        for name, direction in (("reference", np.array(hinge.reference)), ("axis", axis)):
            size = float(np.linalg.norm(direction))
            _expect(abs(size - 1.0) <= UNIT_TOLERANCE, f"{path}.{name}", size, "a length of 1")
        across = float(np.linalg.norm(bone - (bone @ axis) * axis))
        _expect(across >= 0.5, f"{path}.bone", list(bone), "a direction across the axis")
        for low, high in zip(hinge.low, hinge.high, strict=True):
            right = -np.pi <= low <= high <= np.pi
            _expect(right, path, [low, high], "angles in order, from -pi to pi")


def _check_robot(card: ModelCard) -> None:
    robot = card.robot
    _expect(robot is not None or not card.soles, "soles", len(card.soles), "none without a robot")
    if robot is None:
        return
    bodies, hinges = len(robot.bodies), len(robot.hinges)
    for name, values, shape in (
        ("parents", np.array(robot.parents), (bodies,)),
        ("offsets", robot.offsets, (bodies, 3)),
        ("turns", robot.turns, (bodies, 4)),
        ("hinge_bodies", np.array(robot.hinge_bodies), (hinges,)),
        ("axes", robot.axes, (hinges, 3)),
        ("anchors", robot.anchors, (hinges, 3)),
        ("ranges", robot.ranges, (hinges, 2)),
    ):
        _expect(values.shape == shape, f"robot.{name}", values.shape, f"the shape {shape}")
    ordered = all(-1 < parent < body for body, parent in enumerate(robot.parents) if body)
    _expect(ordered, "robot.parents", robot.parents, "each parent before its children")
    known = all(0 < body < bodies for body in robot.hinge_bodies)
    _expect(known, "robot.hinge_bodies", robot.hinge_bodies, f"bodies from 1 to {bodies - 1}")
    for foot in robot.feet:
        _expect(0 <= foot.body < bodies, "robot.feet", foot.body, f"bodies below {bodies}")
        _expect(foot.points.shape[1:] == (3,), "robot.feet", foot.points.shape, "points of three")
    for name, vectors in (("axes", robot.axes), ("turns", robot.turns)):
        lengths = np.linalg.norm(vectors, axis=-1)
        unit = bool(np.all(np.abs(lengths - 1.0) <= UNIT_TOLERANCE))
        _expect(unit, f"robot.{name}", lengths.tolist(), "lengths of 1")
    skeleton = robot_clip.of(robot).skeleton
    _expect(skeleton.same_tree(card.skeleton), "robot", robot.name, "the joints of the skeleton")
    for index, point in enumerate(card.soles):
        path, steps = f"soles[{index}]", card.frames - 1
        _expect(0 < point.body < bodies, f"{path}.body", point.body, f"1 to {bodies - 1}")
        begin = 0
        for first, last in point.stances:
            in_order = begin <= first < steps and first <= last < first + steps
            _expect(in_order, f"{path}.stances", [first, last], "frames of a cycle in order")
            begin = last + 1
        ends = bool(point.stances) and begin <= point.stances[0][0] + steps
        _expect(ends, f"{path}.stances", point.stances, "stances that do not overlap")


def _shapes(card: ModelCard) -> dict[str, tuple[int, ...]]:
    """Return the shapes of constants that the exporter writes for a card, ANY for other sizes."""
    joints, controls, labels = len(card.skeleton), len(card.controls), sum(card.label_counts)
    r1, r2, r3 = card.levels[0].ranks
    shapes = {
        "ladder": (len(card.levels), ANY_SIZE),
        "samples": (controls, card.samples),
        "sill": (1,),
        "pose_weights": (card.samples, r3 + card.levels[0].event),
        "linear_weights": (labels + 1 + controls, ANY_SIZE),
        "core": (r2, r1, r3),
        "time_basis": (r2, card.frames),
        "root_mean": (3,),
        "directions": (ANY_SIZE, r1),
        "mean_rotations": (joints, 4, 1),
        "rotation_mean": (4 * joints, 1),
        "offset_mean": (3 * joints,),
        "freedoms": (3 + 3 * joints + len(card.curves),),
    }
    if card.curves:
        shapes["curve_mean"] = (len(card.curves),)
    if card.contacts:
        shapes["contact_weights"] = (labels + 1 + controls + card.samples, ANY_SIZE)
        shapes["contact_table"] = (ANY_SIZE, len(card.contacts), card.frames)
    # Without label sets the graph has no such constants.
    labelled: dict[str, tuple[int, ...]] = {"labels": (1, labels) if labels else ()}
    blended = {"event_mixing": (ANY_SIZE, r2), "event_times": (ANY_SIZE, card.frames)}
    # They come first, since other shapes follow from the number of labels.
    labelled |= {f"whose_{index}": (card.samples,) for index in range(len(card.labels))}
    return labelled | shapes | (blended if card.levels[0].event else dict.fromkeys(blended, ()))
