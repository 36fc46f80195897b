"""What a model answers: poses or a clip, and how far they may be trusted."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from service.motion.card import Control
from service.motion.clip import Clip
from service.motion.conventions import Floats, Singles, Truths

Number = TypeVar("Number", bound=np.floating[Any])


@dataclass(frozen=True)
class Met:
    """What an answer was held to, and how far it stays from it.

    what: a control's name, or joint and moment of a target. miss: distance of the answer from what
    was asked for, in `unit`. reached: whether it is met to a
    millimetre, or a thousandth of its unit.
    """

    what: str
    miss: float
    unit: str
    reached: bool


@dataclass(frozen=True)
class Trust:
    """Where an answer comes from and what it is worth.

    model: name@contenthash. controls: the values that were asked for, in the model's units.
    duration: natural length of the whole clip at these controls, s. sigma: how far a captured
    clip at these controls would lie from this one, as a root-mean-square over joints and frames,
    m. warnings: one sentence for each control outside what was sampled, or one where the controls
    lie in a gap of it, and one for each target that is not reached. performer: who was asked for;
    none for somebody who was never seen. level: of detail. supported: whether anything like these
    controls was captured. performer_seen: whether somebody captured was asked for; none where the
    model tells nobody apart. inferred: names of the controls that were not given, and chosen as the
    most typical for those that were. measured: the controls that the recipe says how to measure, as
    the answer has them. targets: what the answer was held to. joint_sigma (J,), m: sigma of each
    joint, where it was asked for.
    """

    model: str
    controls: dict[str, float]
    duration: float
    sigma: float
    warnings: tuple[str, ...]
    performer: str | None = None
    level: int = 0
    supported: bool = True
    performer_seen: bool | None = None
    inferred: tuple[str, ...] = ()
    measured: Mapping[str, float] = field(default_factory=dict)
    targets: tuple[Met, ...] = ()
    joint_sigma: tuple[float, ...] = ()

    def facts(self) -> dict[str, Any]:
        """The same as plain values, for formats that carry free metadata; what there is nothing to
        say of is left out."""
        return {
            "model": self.model,
            "controls": self.controls,
            "performer": self.performer,
            "level": self.level,
            "duration": self.duration,
            "sigma": self.sigma,
            "supported": self.supported,
            "warnings": list(self.warnings),
            **self._more(),
        }

    def _more(self) -> dict[str, Any]:
        seen = {} if self.performer_seen is None else {"performer_seen": self.performer_seen}
        more = {
            "inferred": list(self.inferred),
            "measured": dict(self.measured),
            "targets": [asdict(met) for met in self.targets],
            "joint_sigma": list(self.joint_sigma),
        }
        return seen | {name: fact for name, fact in more.items() if fact}


@dataclass(frozen=True)
class PoseAnswer(Generic[Number]):
    """Poses at times (S,), s: rotations (S, J, 4), root_position (S, 3), bone_offsets (J, 3)."""

    times: Floats
    rotations: NDArray[Number]
    root_position: NDArray[Number]
    bone_offsets: NDArray[Number]
    trust: Trust


@dataclass(frozen=True)
class ClipAnswer:
    """A clip sampled at a constant rate."""

    clip: Clip
    trust: Trust


@dataclass(frozen=True)
class Axis:
    """A control of a grid and its values (n,), in its unit."""

    control: Control
    values: Floats


@dataclass(frozen=True)
class SigmaGrid:
    """Sigma (R, C), m, of the finest level, whether all controls lie inside what was sampled,
    inside (R, C), and whether anything like them was captured, supported (R, C), for the columns
    of one axis and the rows of another.

    model: name@contenthash. controls: the values of those that are no axes.
    """

    model: str
    across: Axis
    along: Axis
    controls: dict[str, float]
    performer: str | None
    sigma: Singles
    inside: Truths
    supported: Truths


@dataclass(frozen=True)
class Captured:
    """A captured clip, and what it has to do with an answer.

    source: its file and frames. distance: from the controls asked for, in the model's own metric;
    at one, the poses of two clips have almost nothing to do with each other. weight: what it
    counts for in the answer's poses.
    """

    source: str
    controls: dict[str, float]
    performer: str | None
    distance: float
    weight: float


@dataclass(frozen=True)
class Backing:
    """Whether anything like some controls was captured, and by what that was told.

    beyond: how far each control lies beyond its sampled range, as a share of it, of which `most` is
    allowed. variance: of a plain field over the controls of the captured clips, from 0 where many
    are near to 1 where none is. limit: the most at which something like it was captured.
    """

    supported: bool
    beyond: dict[str, float]
    most: float
    variance: float
    limit: float


@dataclass(frozen=True)
class Reasons:
    """Why an answer is as it is: the captured clips nearest to it, the nearest first, and how many
    others there are, with what all of them count for. All weights add up to one.

    model: name@contenthash. warnings: as in Trust. inferred: names of the controls that were not
    given, as of an answer.
    """

    model: str
    controls: dict[str, float]
    performer: str | None
    warnings: tuple[str, ...]
    backing: Backing
    nearest: tuple[Captured, ...]
    others: int
    others_weight: float
    inferred: tuple[str, ...] = ()


@dataclass(frozen=True)
class Suggestion:
    """A point to capture.

    gain: share by which the mean variance over all that may be asked falls if it is. variance: at
    the point itself, from 0 to 1. nearest: source of the captured clip nearest to it;
    none for models that do not keep them. lacking: the control in which that differs most, by
    `gap`, a share of its range.
    """

    controls: dict[str, float]
    gain: float
    variance: float
    nearest: str | None
    lacking: str
    gap: float


@dataclass(frozen=True)
class Suggestions:
    """Points to capture next, the one that is worth most first; each as if those before it were.

    model: name@contenthash. performer: whose clips alone counted as captured; none for everybody's.
    candidates: of how many points they were chosen.
    """

    model: str
    performer: str | None
    candidates: int
    suggestions: tuple[Suggestion, ...]
