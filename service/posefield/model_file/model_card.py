"""The model card: the description of a model in the metadata of its .onnx file.

Every entry is JSON text under a key that begins with "posefield."; `FORMAT` changes whenever an
older reader would misread a file. `checked_file` reads what `dump` writes.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, Literal, SupportsFloat

import msgspec
import numpy as np

from posefield.common.bounded_types import (
    Count,
    Index,
    Key,
    Name,
    NonNegative,
    Number,
    Positive,
    Rate,
    Share,
    Slug,
    Text,
)
from posefield.common.units import Floats, Positions
from posefield.kriging.kriging_model import Hyper
from posefield.motion import measures
from posefield.motion.contact_detection import FootContact
from posefield.motion.curves import Curve
from posefield.motion.hinges import Hinge
from posefield.motion.measures import Measure
from posefield.motion.quat import ChartName
from posefield.motion.skeleton import Skeleton
from posefield.robots.robot import Robot
from posefield.robots.standing_soles import SolePoint


@dataclass(frozen=True)
class Level:
    """One level of detail of a model; the finest comes first, and ranks never grow after it.

    ranks: of the core tensor. samples: number of clips from which coefficients are interpolated.
    joints: indices of the moving joints; the others keep the family's mean rotation. numbers: count
    of the numbers in the file that the level reads; bytes: their size in float32. operations:
    multiply-adds of one pose. rms, p99, max: of the distances, m, between its joints and those of
    the untruncated model, over random controls, performers and times. pose: the largest root mean
    square over the joints of one pose, m. effector: root mean square of the event's joint at its
    event, m. event: number of leading coefficients with a second prediction around the event.
    """

    ranks: tuple[Count, Count, Count]
    samples: Count
    joints: tuple[Index, ...]
    numbers: Index
    bytes: Index
    operations: Index
    rms: NonNegative
    p99: NonNegative
    pose: NonNegative
    max: NonNegative
    effector: NonNegative | None
    event: Index = 0


ACCELERATION_RATE = 60.0
"""Frames a second at which accelerations are measured; at higher rates noise adds to them."""
USUAL_PERCENTILE = 99.0
"""Percentile of the accelerations of motions that is their usual largest one."""


@dataclass(frozen=True)
class CapturedAcceleration:
    """Accelerations in the frames of captured clips, m/s², as `mean_accelerations`
    at ACCELERATION_RATE.

    median, p99: median and 99th percentile over the frames of all clips together.
    """

    median: NonNegative
    p99: NonNegative


def mean_accelerations(positions: Positions, rate: float) -> Annotated[Floats, "inner"]:
    """Return mean accelerations (F - 2,) of joints (F, J, 3) relative to the root, m/s².

    positions: m, of frames at a rate, the root first. They are second differences; none for fewer
    than three frames.
    """
    if len(positions) < 3:
        return np.zeros(0)
    second = np.diff(positions - positions[:, :1], n=2, axis=0) * rate**2
    means: Floats = np.linalg.norm(second, axis=-1).mean(axis=-1)
    return means


ROW_VALUES = {
    "rotations": "rotation_rows",
    "root_position": "root_rows",
    "bone_offsets": "offset_rows",
    "duration": "duration_column",
    "sigma": "sigma_columns",
    "travel": "travel_rows",
    "curves": "curve_rows",
}
"""Name of the value with the rows, by output of the graph."""


FORMAT = 5
PREFIX = "posefield."
OPTIONAL_ENTRIES = (
    "presets",
    "curves",
    "contacts",
    "captured_acceleration",
    "hinges",
    "robot",
    "soles",
)
"""Entries that a file lacks where they are empty, or None."""
UNITS = {"length": "m", "time": "s", "rotation": "quaternion wxyz", "up": "+y"}


@dataclass(frozen=True)
class Control:
    """One control parameter, its unit and its sampled range.

    default: its value in the medoid clip, so that all defaults are those of one clip. values: the
    distinct sampled values where there are at most ten (a handful of performers, sitting or
    standing), else empty. measure: how it is measured of a motion; None for a control whose values
    come from the table of clips.
    """

    name: Key
    unit: Text
    description: Text
    minimum: Number
    maximum: Number
    default: Number
    values: tuple[Number, ...]
    measure: Measure | None = None


PERFORMER = "performer"
"""Label set of the people who move; requests may name one of it in a field of its own."""


@dataclass(frozen=True)
class LabelSet:
    """Names by which clips differ besides their controls, such as performers or styles.

    name: of the set. names: in the order of the graph's weights. clips (N,): index of each captured
    clip's name.
    """

    name: Key
    names: tuple[Name, ...]
    clips: tuple[Index, ...]


@dataclass(frozen=True)
class Event:
    """Joint and moment of a motion's main event, such as the hand at the end of a grasp.

    share: moment as a share of a clip's duration, mean over the captured clips.
    """

    joint: Index
    share: Share


@dataclass(frozen=True)
class Preset:
    """Named point of the controls, within the sampled ranges.

    controls: a value for each control. labels: name by label set; sets that are not given are left
    open.
    """

    name: Key
    controls: Mapping[Key, Number]
    labels: Mapping[Key, Name] = field(default_factory=dict)


@dataclass(frozen=True)
class TrainingParameters:
    """Parameters of training that the graph does not hold and that adapting a model needs.

    fields: nugget, trend and the offset of each label set, by kriged quantity but the pose.
    landmarks: columns of the table that name them, and their canonical times. joint_weights: of
    joints whose weight in the metric is not one. in_phase: whether cycles were shifted to begin in
    phase. takes (N,): number of each captured clip's take; empty where each file is a take.
    facing: degrees from the root's +z in the files to the body's facing, to the left; None for
    motions without one. take_root (4, r3 + 4): of a cycle, last rows of a root of the covariance of
    the errors of the coefficients, of the duration's logarithm and of the travel, for a sigma of
    one metre. detail: of a cycle, deviations that no control predicts (`reduced_motion`).
    repeat_duration: standard deviation of the logarithm of the duration of repeats of one performer
    at equal controls; 0 for cycles, and in files of earlier versions. chart: of the numbers of
    rotations (`quat`).
    """

    fields: Mapping[Name, tuple[NonNegative, ...]] = field(default_factory=dict)
    landmarks: Mapping[Name, Share] = field(default_factory=dict)
    joint_weights: Mapping[Name, Positive] = field(default_factory=dict)
    in_phase: bool = False
    takes: tuple[Index, ...] = ()
    facing: Number | None = 0.0
    take_root: tuple[tuple[Number, ...], ...] = ()
    detail: bytes = b""
    repeat_duration: NonNegative = 0.0
    chart: ChartName = "rotation_vector"


@dataclass(frozen=True)
class ModelCard:
    """Everything about a model but its weights.

    cyclic: the last pose leads into the first. root: whether the root travels or stays in place.
    rate: frames a second of the captured clips. frames, samples: T and N of the motion tensor.
    levels: of detail, the finest first. durations: shortest and longest captured clip, s. labels:
    label sets, in the order of the graph's weights; empty where the controls alone distinguish
    clips. examples (N, d): controls of the captured clips. feet: indices of the joints that contact
    the ground, empty where the recipe names none. diagnostics: measured in training. provenance:
    recipe, hashes of the data, versions, licence. sources (N,): file and frames of each captured
    clip. kriging: parameters of the pose's kriging. left_out (N,): distance between each clip and
    its prediction from the others, root mean square over joints and frames, m. joint_sigma (J,):
    error of each joint as a share of sigma. making: not sent to clients. roles: joints by the part
    that each plays (`joint_roles`). event: None where the recipe names none. beside (4, 4): of a
    cycle, a root of the covariance of the errors of its duration's logarithm and its travel, for a
    sigma of one metre; else empty. presets: named points of the controls; the file has no such
    entry if the recipe names none. curves: scalar channels of the family, in the order of the
    graph's output `curves`; the file has no such entry without them. contacts: joints that contact
    the ground or a thing, in the order of the graph's output `contacts`, whose values are the
    probabilities of their contacts; the file has neither without them. captured_acceleration: of
    the clips of the training, with which joins of performances are compared; None in files of
    earlier versions. hinges: limits of knees and elbows, not sent to clients; empty without roles
    and in files of earlier versions, whose joints have no limits. robot: whose bodies the joints
    are, not sent to clients; None for others. soles: points of the robot's soles that stand, not
    sent to clients; empty where its gaits have no stances in common.
    """

    name: Slug
    description: Text
    controls: tuple[Control, ...]
    skeleton: Skeleton
    cyclic: bool
    root: Literal["travelling", "in_place"]
    rate: Rate
    frames: Count
    samples: Count
    levels: tuple[Level, ...]
    durations: tuple[Positive, Positive]
    labels: tuple[LabelSet, ...]
    examples: tuple[tuple[Number, ...], ...]
    feet: tuple[Index, ...]
    diagnostics: Mapping[str, Any]
    provenance: Mapping[str, Any]
    sources: tuple[Text, ...]
    kriging: Hyper
    left_out: tuple[NonNegative, ...]
    joint_sigma: tuple[NonNegative, ...]
    making: TrainingParameters
    roles: Mapping[Name, Name] = field(default_factory=dict)
    event: Event | None = None
    beside: tuple[tuple[Number, ...], ...] = ()
    presets: tuple[Preset, ...] = ()
    curves: tuple[Curve, ...] = ()
    contacts: tuple[FootContact, ...] = ()
    captured_acceleration: CapturedAcceleration | None = None
    hinges: tuple[Hinge, ...] = ()
    robot: Robot | None = None
    soles: tuple[SolePoint, ...] = ()

    @property
    def clip_labels(self) -> Floats:
        """Return the weights (N, p) of the captured clips' labels: one for a clip's own names."""
        indicators = [np.eye(len(one.names))[list(one.clips)] for one in self.labels]
        return np.hstack([np.zeros((len(self.examples), 0)), *indicators])

    @property
    def label_counts(self) -> tuple[int, ...]:
        """Return the number of names of each label set."""
        return tuple(len(label.names) for label in self.labels)

    @cached_property
    def performers(self) -> tuple[str, ...]:
        """Return the names of performers; empty where the model does not distinguish them."""
        return next((label.names for label in self.labels if label.name == PERFORMER), ())

    @property
    def moved_by(self) -> tuple[int, ...]:
        """Return the index of each clip's performer; empty where `performers` is."""
        return next((label.clips for label in self.labels if label.name == PERFORMER), ())

    def clip_names(self, clip: int) -> dict[str, str]:
        """Return the name of a captured clip in each label set."""
        return {label.name: label.names[label.clips[clip]] for label in self.labels}

    @property
    def sampled_ranges(self) -> tuple[Floats, Floats]:
        """Return the smallest and the largest sampled value (d,) of each control."""
        low, high = np.transpose([(c.minimum, c.maximum) for c in self.controls])
        return low, high

    def control(self, name: str) -> Control | None:
        """Return the control of that name; None for an unknown name."""
        return next((c for c in self.controls if c.name == name), None)


def rounded(value: SupportsFloat) -> float:
    """Return a measured number as cards store it, with four significant digits."""
    return float(f"{float(value):.4g}")


def dump(card: ModelCard) -> dict[str, str]:
    """Return the metadata entries of a card: keys in a fixed order, values JSON text."""
    making: dict[str, Any] = msgspec.to_builtins(card.making)
    defaults = msgspec.to_builtins(TrainingParameters())
    changed = {key: value for key, value in making.items() if value != defaults[key]}
    plain = {**_plain_fields(card), "format": FORMAT, "making": changed}
    for name in OPTIONAL_ENTRIES:
        if not getattr(card, name):
            plain.pop(name, None)
    return {PREFIX + key: json.dumps(plain[key], sort_keys=True) for key in sorted(plain)}


def plain_values(card: ModelCard) -> dict[str, Any]:
    """Return the card as numbers, texts, lists and dicts, but for parts that are not sent.

    The label set of performers is given in keys of its own, too, as in requests.
    """
    plain = _plain_fields(card)
    plain.pop("hinges")
    plain.pop("robot")
    plain.pop("soles")
    for preset in plain["presets"]:
        preset["performer"] = preset["labels"].pop(PERFORMER, None)
    return {**plain, "performers": list(card.performers), "moved_by": list(card.moved_by)}


def _plain_fields(card: ModelCard) -> dict[str, Any]:
    """Return the fields of the card but `making`, as numbers, texts, lists and dicts."""
    plain: dict[str, Any] = msgspec.to_builtins(card, enc_hook=np.ndarray.tolist)
    del plain["making"]
    for name in ("curves", "contacts", "captured_acceleration"):
        if not getattr(card, name):
            plain.pop(name, None)
    # msgspec leaves out defaults of objects that it decoded.
    for control, control_card in zip(plain["controls"], card.controls, strict=True):
        control.pop("measure", None)
        if control_card.measure:
            control["measure"] = measures.to_dict(control_card.measure)
    for preset, point in zip(plain["presets"], card.presets, strict=True):
        preset["labels"] = dict(point.labels)
    joints = plain["skeleton"]
    # To the micrometre.
    joints["offsets"] = np.round(card.skeleton.offsets, 6).tolist()
    joints["tip_offsets"] = np.round(card.skeleton.tip_offsets, 6).tolist()
    return {**plain, "units": dict(UNITS)}
