"""The model card: what an .onnx file says of itself in its metadata.

Reader and writer stand in this one file so that they cannot drift apart. Every value is JSON text
under a key that begins with "posefield."; `FORMAT` changes whenever an older reader would go wrong.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from service.motion import measure, roles
from service.motion.conventions import Floats
from service.motion.detail import Level
from service.motion.field import Hyper
from service.motion.measure import Measure
from service.motion.skeleton import Skeleton

FORMAT = 2
PREFIX = "posefield."


@dataclass(frozen=True)
class Control:
    """One control parameter, its unit and what of it was sampled.

    default: the sampled value in the middle. values: the distinct sampled values where they are
    few (a handful of performers, sitting or standing), else empty. measure: how it is read off a
    motion; None where somebody typed it, and in files older than this.
    """

    name: str
    unit: str
    description: str
    minimum: float
    maximum: float
    default: float
    values: tuple[float, ...]
    measure: Measure | None = None


@dataclass(frozen=True)
class Event:
    """What the motion is for: a joint, at a moment.

    share: of a clip's duration, in the mean over the captured ones.
    """

    joint: int
    share: float


@dataclass(frozen=True)
class Making:
    """What a model's fields were solved with and its graph does not say: adapting it takes that.

    fields: of each field of the controls but the pose, its nugget and the degrees of its drifts.
    landmarks: columns of the table that name them, and their canonical times. joint_weights: of
    joints whose weight in the metric is not one. in_phase: cycles were brought to begin together.
    """

    fields: Mapping[str, tuple[float, ...]]
    landmarks: Mapping[str, float] = field(default_factory=dict)
    joint_weights: Mapping[str, float] = field(default_factory=dict)
    in_phase: bool = False


@dataclass(frozen=True)
class ModelCard:
    """Everything a client needs to know of a model but its weights.

    cyclic: the last pose leads into the first. root: whether the root travels or stays in place.
    rate: frames a second of the captured clips. frames, samples: T and N of the motion tensor.
    levels: of detail, the finest first. durations: shortest and longest captured clip, s.
    performers: who can be asked for by name, in the order of the graph's labels; empty where
    performers are not told apart. examples (N, d): controls of the captured clips; moved_by (N,):
    whose each is, by place among the performers, empty where they are not told apart. feet: indices
    of the joints that stand on the ground, empty where nobody said. diagnostics: what training
    measured. provenance: recipe, hashes of the data, versions, licence. roles: joints by the part
    that each plays (service/motion/roles.py), empty where nobody said. sources (N,): file and
    frames of each captured clip. kriging: what the weight of each of them hangs on; None, and no
    sources, in files older than these. left_out (N,): how far each of them lies from what the
    others predict for it, root mean square over joints and frames, m; empty in files older than
    this. event: None where the recipe names none, and in files older than this. beside: of a cycle
    a root of the covariance by which captured clips stray in the logarithm of their duration and in
    their travel, for a sigma of one metre; empty for what is no cycle, and in older files.
    joint_sigma (J,): how far each joint errs, as a share of sigma; empty in files older than this.
    making: nothing that a client needs; None in files older than this.
    """

    name: str
    description: str
    controls: tuple[Control, ...]
    skeleton: Skeleton
    cyclic: bool
    root: Literal["travelling", "in_place"]
    rate: float
    frames: int
    samples: int
    levels: tuple[Level, ...]
    durations: tuple[float, float]
    performers: tuple[str, ...]
    examples: tuple[tuple[float, ...], ...]
    moved_by: tuple[int, ...]
    feet: tuple[int, ...]
    diagnostics: Mapping[str, Any]
    provenance: Mapping[str, Any]
    roles: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    kriging: Hyper | None = None
    left_out: tuple[float, ...] = ()
    event: Event | None = None
    beside: tuple[tuple[float, ...], ...] = ()
    joint_sigma: tuple[float, ...] = ()
    making: Making | None = None

    @property
    def labels(self) -> Floats:
        """Labels (N, p) of who moved in each captured clip; of width zero where nobody is told
        apart."""
        moved = np.array(self.moved_by or [0] * len(self.examples))
        return np.eye(max(len(self.performers), 1), len(self.performers))[moved]

    def control(self, name: str) -> Control | None:
        """The control of that name, if there is one."""
        return next((c for c in self.controls if c.name == name), None)


def dump(card: ModelCard) -> dict[str, str]:
    """Metadata entries of a card: keys in a fixed order, values JSON text."""
    plain = {**plain_values(card), "format": FORMAT}
    if card.making:
        plain["making"] = _plain_making(card.making)
    return {PREFIX + key: json.dumps(plain[key], sort_keys=True) for key in sorted(plain)}


def plain_values(card: ModelCard) -> dict[str, Any]:
    """The card as numbers, strings, lists and objects, but for what no client needs."""
    joints = card.skeleton
    return {
        **{key: getattr(card, key) for key in _AS_THEY_ARE},
        "controls": [_plain_control(control) for control in card.controls],
        "levels": [_plain_level(level) for level in card.levels],
        "durations": list(card.durations),
        "performers": list(card.performers),
        "examples": [list(point) for point in card.examples],
        "moved_by": list(card.moved_by),
        "feet": list(card.feet),
        "diagnostics": dict(card.diagnostics),
        "provenance": dict(card.provenance),
        "roles": dict(card.roles),
        "sources": list(card.sources),
        "kriging": _plain_hyper(card.kriging),
        "left_out": list(card.left_out),
        "event": asdict(card.event) if card.event else None,
        "beside": [list(row) for row in card.beside],
        "joint_sigma": list(card.joint_sigma),
        "units": {"length": "m", "time": "s", "rotation": "quaternion wxyz", "up": "+y"},
        "skeleton": {
            "names": list(joints.names),
            "parents": list(joints.parents),
            "offsets": np.round(joints.offsets, 6).tolist(),
            "tip_joints": list(joints.tip_joints),
            "tip_offsets": np.round(joints.tip_offsets, 6).tolist(),
        },
    }


def _plain_control(control: Control) -> dict[str, Any]:
    own = {**vars(control), "values": list(control.values)}
    measured = own.pop("measure")
    return own if measured is None else {**own, "measure": measure.plain(measured)}


def _control(plain: Mapping[str, Any]) -> Control:
    found = plain.get("measure")
    own = None if found is None else measure.parse(found)
    return Control(**{**plain, "values": tuple(plain["values"]), "measure": own})


def _plain_level(level: Level) -> dict[str, Any]:
    return {**asdict(level), "ranks": list(level.ranks), "joints": list(level.joints)}


def _plain_making(making: Making) -> dict[str, Any]:
    """What of it there is: every byte of it travels in every file."""
    return {key: value for key, value in asdict(making).items() if value}


def _making(plain: Mapping[str, Any] | None) -> Making | None:
    if plain is None:
        return None
    fields = {name: tuple(numbers) for name, numbers in plain.get("fields", {}).items()}
    return Making(**{**plain, "fields": fields})


def _plain_hyper(hyper: Hyper | None) -> dict[str, Any] | None:
    if hyper is None:
        return None
    return {**asdict(hyper), "drifts": list(hyper.drifts), "scales": hyper.scales.tolist()}


_AS_THEY_ARE = ("name", "description", "cyclic", "root", "rate", "frames", "samples")


def load(metadata: Mapping[str, str]) -> ModelCard:
    """Card of a model's metadata entries; ValueError says what is missing or too new."""
    if PREFIX + "format" not in metadata:
        raise ValueError("no posefield metadata: it was not written by posefield")
    own = {key: text for key, text in metadata.items() if key.startswith(PREFIX)}
    plain = {key.removeprefix(PREFIX): _parse(key, text) for key, text in own.items()}
    if plain["format"] != FORMAT:
        raise ValueError(f"model format {plain['format']}, this version reads format {FORMAT}")
    try:
        return _from_plain(plain)
    except (KeyError, TypeError) as fault:
        raise ValueError(f"incomplete posefield metadata: {fault}") from fault


def _parse(key: str, text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as fault:
        raise ValueError(f"metadata {key} is not JSON: {fault}") from fault


def _from_plain(plain: Mapping[str, Any]) -> ModelCard:
    joints = plain["skeleton"]
    return ModelCard(
        **{key: plain[key] for key in _AS_THEY_ARE},
        controls=tuple(map(_control, plain["controls"])),
        skeleton=Skeleton(
            tuple(joints["names"]),
            tuple(joints["parents"]),
            np.array(joints["offsets"], dtype=float).reshape(-1, 3),
            tuple(joints["tip_joints"]),
            np.array(joints["tip_offsets"], dtype=float).reshape(-1, 3),
        ),
        levels=tuple(
            Level(**{**level, "ranks": tuple(level["ranks"]), "joints": tuple(level["joints"])})
            for level in plain["levels"]
        ),
        durations=tuple(plain["durations"]),
        performers=tuple(plain["performers"]),
        examples=tuple(map(tuple, plain["examples"])),
        moved_by=tuple(plain["moved_by"]),
        feet=tuple(plain["feet"]),
        diagnostics=plain["diagnostics"],
        provenance=plain["provenance"],
        roles=_roles(plain),
        sources=tuple(plain.get("sources", ())),
        kriging=_hyper(plain.get("kriging")),
        left_out=tuple(plain.get("left_out", ())),
        event=_event(plain.get("event")),
        beside=tuple(map(tuple, plain.get("beside", ()))),
        joint_sigma=tuple(plain.get("joint_sigma", ())),
        making=_making(plain.get("making")),
    )


def _event(plain: Mapping[str, Any] | None) -> Event | None:
    return None if plain is None else Event(**plain)


def _hyper(plain: Mapping[str, Any] | None) -> Hyper | None:
    if plain is None:
        return None
    scales = np.array(plain["scales"], dtype=float)
    return Hyper(**{**plain, "drifts": tuple(plain["drifts"]), "scales": scales})


def _roles(plain: Mapping[str, Any]) -> dict[str, str]:
    """Roles of a card; those who wrote none needed no other format for it."""
    given = dict(plain.get("roles", {}))
    roles.check(given, plain["skeleton"]["names"])
    return given
