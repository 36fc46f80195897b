"""What a truncation does to the joints: true distances, by forward kinematics.

The metric of the tensor is first-order, and counts a sphere of skin round every joint; where joints
really end up is asked of the kinematics itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model_export.hosvd import Multilinear
from model_export.ingest import Example
from model_export.recipe import Recipe
from model_export.tensor import MotionTensor
from service.motion import skeleton
from service.motion.card import Event
from service.motion.conventions import Floats
from service.motion.errors import TrainingError


@dataclass(frozen=True)
class Fidelity:
    """Distances between joints of the truncated and the whole tensor, m.

    rms: root mean square over clips, frames and joints, those by their weights. p99, max: over the
    same, all joints alike. effector: root mean square over clips of the event's joint at its event.
    """

    rms: float
    p99: float
    max: float
    effector: float | None


@dataclass(frozen=True)
class Moment:
    """A joint and the canonical frame at which its place counts."""

    joint: int
    frame: int


@dataclass(frozen=True)
class Judge:
    """Where the joints (N, T, J, 3) of the whole tensor are, m, and what a truncation is asked.

    A cycle's travel is out of both sides. offsets (N, J, 3), m; weights (J,): of the joints.
    """

    own_tensor: MotionTensor
    parents: tuple[int, ...]
    offsets: Floats
    weights: Floats
    moment: Moment | None
    whole: Floats

    def of(self, reduced: Multilinear) -> Fidelity:
        """Fidelity of a truncation of this tensor."""
        found = positions(self.own_tensor, reduced.restored(), self.parents, self.offsets)
        gaps = np.linalg.norm(found - self.whole, axis=-1)
        squares = np.mean(np.square(gaps), axis=(0, 1))
        return Fidelity(
            float(np.sqrt(np.average(squares, weights=self.weights))),
            float(np.quantile(gaps, 0.99)),
            float(gaps.max()),
            _effector(gaps, self.moment),
        )


def joint_weights(recipe: Recipe, examples: Sequence[Example]) -> Floats:
    """Importance (J,) of each joint's position: what the recipe says, or one."""
    names = examples[0].clip.skeleton.names
    return np.array([recipe.motion.joint_weights.get(name, 1.0) for name in names])


def judge(recipe: Recipe, examples: Sequence[Example], own_tensor: MotionTensor) -> Judge:
    """Judge of the truncations of a recipe's tensor.

    Raises TrainingError where the event's joint is none of the skeleton's.
    """
    parents, weights = examples[0].clip.skeleton.parents, joint_weights(recipe, examples)
    offsets = np.stack([example.offsets for example in examples])
    whole = positions(own_tensor, own_tensor.values, parents, offsets)
    return Judge(own_tensor, parents, offsets, weights, moment(recipe, examples), whole)


def positions(
    own_tensor: MotionTensor, values: Floats, parents: tuple[int, ...], offsets: Floats
) -> Floats:
    """Joint positions (N, T, J, 3) of whitened values (D', T, N), bone offsets (N, J, 3), m."""
    rotations, root = own_tensor.chart.poses(own_tensor.numbers(values))
    return skeleton.forward(parents, rotations, skeleton.translations(offsets, root))[0]


def _effector(gaps: Floats, moment: Moment | None) -> float | None:
    if moment is None:
        return None
    return float(np.sqrt(np.mean(np.square(gaps[:, moment.frame, moment.joint]))))


def moment(recipe: Recipe, examples: Sequence[Example]) -> Moment | None:
    """Where and when the recipe's event is; None where it names none.

    Raises TrainingError where its joint is none of the skeleton's.
    """
    event = recipe.event
    if event is None:
        return None
    names = examples[0].clip.skeleton.names
    if event.joint not in names:
        raise TrainingError(f"event.joint {event.joint!r}, expected one of {', '.join(names)}")
    return Moment(names.index(event.joint), _frame(recipe, event.at, examples))


def event(recipe: Recipe, examples: Sequence[Example]) -> Event | None:
    """The same for who knows no canonical frames; None where the recipe names no event."""
    found = moment(recipe, examples)
    if found is None or recipe.event is None:
        return None
    return Event(found.joint, round(_share(recipe, recipe.event.at, examples), 4))


def _frame(recipe: Recipe, at: str, examples: Sequence[Example]) -> int:
    """Canonical frame of the event: landmarks were brought to the mean of their times."""
    return round((recipe.motion.frames - 1) * _share(recipe, at, examples))


def _share(recipe: Recipe, at: str, examples: Sequence[Example]) -> float:
    if at == "end":
        return 1.0
    mark = recipe.clips.landmarks.index(at)
    return float(np.mean([example.landmarks[mark] for example in examples]))
