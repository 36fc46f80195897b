"""Results of a query: poses or clips with provenance and uncertainty, sigma grids, reasons."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, Protocol, TypeVar

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from posefield.common.units import MICROMETRES, Booleans, Floats, Singles
from posefield.model_file.model_card import Control
from posefield.motion.clip import Clip
from posefield.question.motion_question import Floor, LabelValue
from posefield.robots.robot import Robot

Number = TypeVar("Number", bound=np.floating[Any])


Band = Literal["close", "near", "rough", "guess"]
"""Name of a range of sigma, on one scale for all models."""
BANDS: tuple[tuple[Band, float], ...] = (("close", 0.03), ("near", 0.075), ("rough", 0.15))
"""Bands and their largest sigma, m; beyond the last one, an answer is a guess.

From the errors of left-out clips: 99 % of those of the procedural family are below 3 cm, 95 % of
the walk's below 7.5 cm, and three in four of those of a hand that reaches high below 15 cm; above
it lie answers of that family and of a deposit on the floor for an unnamed performer.
"""


def band(sigma: float) -> Band:
    """Return the band of sigma, m."""
    return next((name for name, largest in BANDS if sigma <= largest), "guess")


def round_micrometres(value: float) -> float:
    """Return a number of an answer, such as a length, m, rounded to six decimals."""
    return round(float(value), MICROMETRES)


@dataclass(frozen=True)
class ConstraintResult:
    """Residual of one constraint: a measured control or a target.

    what: a control's name, or joint and moment of a target. miss: distance between the requested
    and the reached value, in `unit`. reached: whether the miss is at most a millimetre, or a
    thousandth of the unit.
    """

    what: str
    miss: float
    unit: str
    reached: bool


def split_results(
    results: Sequence[ConstraintResult], targets: int
) -> tuple[tuple[ConstraintResult, ...], tuple[ConstraintResult, ...]]:
    """Return the results of measured controls, which come first, and those of the targets.

    targets: number of targets.
    """
    first = len(results) - targets
    return tuple(results[:first]), tuple(results[first:])


class Deviation(Struct, frozen=True):
    """A requested control whose value the motion does not have.

    asked: requested value. given: value of the motion if the control is measured, else the value at
    which the control acts. captured: smallest and largest sampled value. side: of the given value,
    seen from the requested one.
    """

    control: str
    asked: float
    given: float
    unit: str
    captured: tuple[float, float]
    side: Literal["above", "below"]

    @property
    def sentence(self) -> str:
        """Return the deviation in words, for warnings."""
        low, high = self.captured
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{self.control}: asked {self.asked:.4g}{unit}, given {self.given:.4g}{unit}, "
            f"captured {low:.4g} to {high:.4g}{unit}; {self.side} what was asked"
        )


@dataclass(frozen=True)
class StanceResult:
    """A stance of a foot.

    joint: that contacts. begin, end: s, from the start of the whole clip; in a cycle the end may
    lie in the next one. position: of the joint, m, before the root's travel is removed.
    """

    joint: str
    begin: float
    end: float
    position: tuple[float, ...]


class FeetResult(Struct, frozen=True, omit_defaults=True):
    """Feet of a clip that were made to stand, over the whole motion.

    swings: number of them. skate_before, skate: foot skate as predicted and as given, m/s. drift:
    largest distance over the floor of a standing foot from its place, m. lowered: by how much the
    pelvis was lowered at most, so that the feet reach the floor, m. grounded: by how much the whole
    character was lowered to the floor, m; negative if it was raised. left: one sentence for each
    foot that is as predicted. floor: on which they stand; None for a floor at height 0.
    """

    stances: tuple[StanceResult, ...]
    swings: int
    skate_before: float
    skate: float
    drift: float
    lowered: float
    grounded: float
    left: tuple[str, ...]
    floor: Floor | None = None


class BrokenLimit(Struct, frozen=True):
    """A hinge of a robot beyond its limits in a clip, where it is worst.

    time: s, of its frame from the first. angle: rad. limits: least and largest angle, rad.
    """

    joint: str
    time: float
    angle: float
    limits: tuple[float, float]

    @property
    def sentence(self) -> str:
        """Return the fact in words, for warnings."""
        low, high = self.limits
        return (
            f"{self.joint} turns to {self.angle:.4g} rad at {self.time:.4g} s, and its limits are "
            f"{low:.4g} to {high:.4g} rad"
        )


class Trust(Struct, frozen=True, omit_defaults=True):
    """Provenance and uncertainty of a result.

    model: name@contenthash. controls: requested values in the model's units. duration: of the whole
    clip at these controls, s; of a clip that ends on a frame, that of its frames. sigma: expected
    distance between this clip and a captured clip at these controls, root mean square over joints
    and frames, m. warnings: one sentence for each control outside its sampled range, or one for
    controls in a gap between the samples, one for each deviation, and one for each target that is
    not reached. performer: requested name; None for an unseen performer. level: of detail.
    supported: whether clips with similar controls were captured. performer_seen: whether the
    requested performer was captured; None where the model does not distinguish performers.
    inferred: names of the controls that were not given and were set to the most typical values for
    the given ones. measured: values in this result of the controls for which the recipe has a
    measure. targets: residuals of the constraints. joint_sigma (J,), m: sigma of each joint; empty
    unless requested. deviations: requested controls whose value the motion does not have. labels:
    requested names or weights besides the performer, by label set. feet: of a clip that were made
    to stand; None for feet as predicted. take: seed, variety and detail of the take; empty for the
    prediction. stretch: largest distance in time of a moment of the motion from its frame, s, which
    puts its event, its targets and its end on frames, or gives a loop whole steps; at most half a
    frame, None for frames at equal times. retargeting: report on the motion of a user's character;
    empty for the model's own. limits: hinges of a robot that turn beyond theirs.
    """

    model: str
    controls: dict[str, float]
    performer: str | None
    level: int
    duration: float
    sigma: float
    supported: bool
    warnings: tuple[str, ...]
    performer_seen: bool | None = None
    inferred: tuple[str, ...] = ()
    measured: Mapping[str, float] = {}
    targets: tuple[ConstraintResult, ...] = ()
    joint_sigma: tuple[float, ...] = ()
    deviations: tuple[Deviation, ...] = ()
    labels: Mapping[str, LabelValue] = {}
    feet: FeetResult | None = None
    take: Mapping[str, float] = {}
    stretch: float | None = None
    retargeting: Mapping[str, Any] = {}
    limits: tuple[BrokenLimit, ...] = ()

    def document(self) -> dict[str, Any]:
        """Return the Trust (schema of the contract): the facts and the band of sigma."""
        return {**self.facts(), "band": band(self.sigma)}

    def facts(self) -> dict[str, Any]:
        """Return the fields that are not empty as plain values, for the metadata of files."""
        facts: dict[str, Any] = msgspec.to_builtins(self)
        return facts


@dataclass(frozen=True)
class PoseAnswer(Generic[Number]):
    """Poses at times (S,), s.

    rotations: (S, J, 4). root_position: (S, 3), m. bone_offsets: (J, 3), m. curves: values (S, C)
    of the model's curves; None for a model without them.
    """

    times: Floats
    rotations: NDArray[Number]
    root_position: NDArray[Number]
    bone_offsets: NDArray[Number]
    trust: Trust
    curves: NDArray[Number] | None = None


class Provenance(Protocol):
    """Facts about a motion that its files carry."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return one sentence for each thing that a user should know."""

    def document(self) -> dict[str, Any]:
        """Return the facts as the contract's schema has them."""

    def facts(self) -> dict[str, Any]:
        """Return the facts that are not empty as plain values, for the metadata of files."""


@dataclass(frozen=True)
class SampledClip:
    """A motion sampled at a constant rate, with the facts about it, as encoders write it."""

    clip: Clip
    trust: Provenance


@dataclass(frozen=True)
class ClipAnswer(SampledClip):
    """A clip of one model.

    robot: whose motion it is; None for a model of no robot. loops: whether its last frame equals
    its first.
    """

    trust: Trust
    robot: Robot | None = field(default=None, repr=False)
    loops: bool = False


@dataclass(frozen=True)
class GridAxis:
    """Axis of a grid: a control and its values (n,), in the control's unit."""

    control: Control
    values: Floats


@dataclass(frozen=True)
class SigmaGrid:
    """Sigma over two controls, at the finest level of detail.

    across: axis of the C columns. along: axis of the R rows. model: name@contenthash. controls:
    values of the other controls. sigma (R, C): m. inside (R, C): whether all controls lie within
    their sampled ranges. supported (R, C): whether clips with similar controls were captured.
    """

    model: str
    across: GridAxis
    along: GridAxis
    controls: dict[str, float]
    performer: str | None
    sigma: Singles
    inside: Booleans
    supported: Booleans
    labels: Mapping[str, LabelValue] = field(default_factory=dict)


@dataclass(frozen=True)
class CapturedClip:
    """Captured clip and its contribution to a result.

    source: its file and frames. distance: between its controls and the requested ones, in the
    model's metric; at distance one, at most 5 % of the covariance is left. weight: kriging weight
    of the clip in the poses of the result. share: part of the clip in the sum of the positive
    weights of all clips. labels: its names in the label sets besides `performer`.
    """

    source: str
    controls: dict[str, float]
    performer: str | None
    distance: float
    weight: float
    share: float
    labels: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class SupportReport:
    """Support of a query by the captured clips, and the quantities that decide it.

    beyond: distance of each control beyond its sampled range, as a share of the range; at most
    `most` is supported. variance: kriging variance of a field over the controls of the captured
    clips, from 0 where clips are dense to 1 far from all clips. limit: largest variance that is
    supported.
    """

    supported: bool
    beyond: dict[str, float]
    most: float
    variance: float
    limit: float


@dataclass(frozen=True)
class Explanation:
    """Explanation of a result: the nearest captured clips, the nearest first, and their weights.

    model: name@contenthash. warnings, inferred: as in Trust. others, others_weight, others_share:
    count, total weight and total share of the clips that are not listed. All weights sum to one,
    and so do all shares.
    """

    model: str
    controls: dict[str, float]
    performer: str | None
    warnings: tuple[str, ...]
    backing: SupportReport
    nearest: tuple[CapturedClip, ...]
    others: int
    others_weight: float
    others_share: float
    inferred: tuple[str, ...] = ()
    labels: Mapping[str, LabelValue] = field(default_factory=dict)


@dataclass(frozen=True)
class Suggestion:
    """Point in the control space at which to capture the next clip.

    gain: share by which the mean variance over the control space falls once it is captured.
    variance: at the point itself, from 0 to 1. nearest: source of the nearest captured clip.
    lacking: the control in which that clip differs most. gap: this difference as a share of the
    control's range.
    """

    controls: dict[str, float]
    gain: float
    variance: float
    nearest: str
    lacking: str
    gap: float


@dataclass(frozen=True)
class Suggestions:
    """Points to capture next, by descending gain; each gain assumes the points before as captured.

    model: name@contenthash. performer: name of the performer whose clips alone count as captured;
    None for the clips of all performers. candidates: number of points among which they were
    selected.
    """

    model: str
    performer: str | None
    candidates: int
    suggestions: tuple[Suggestion, ...]
    labels: Mapping[str, LabelValue] = field(default_factory=dict)
