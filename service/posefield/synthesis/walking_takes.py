"""Takes of walking crowds: poses of characters that deviate from the prediction.

Durations and travel stay those of the prediction, so that characters stay on their paths.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.constraints import take_variation
from posefield.inference.reduced_motion import ReducedTensor
from posefield.inference.session import Session
from posefield.kriging import random_field
from posefield.locomotion import locomotion_plan, stride
from posefield.locomotion.crowd_order import CrowdOrder
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.stride import RelativePoses
from posefield.locomotion.walking_crowd import PoseMaker
from posefield.model_file.model_card import ModelCard
from posefield.motion import root_travel
from posefield.question.motion_question import MAX_TAKE
from posefield.question.walk_question import WalkerTake
from posefield.synthesis.synthesizer import Synthesizer

KNOT_SECONDS = 0.2
"""Interval between points of a path at which deviations are computed, s, with lines between: a
character changes its speed over seconds."""


@dataclass(frozen=True)
class WalkerTakes:
    """Takes of N distinct motions of a walking crowd.

    asked: as in the order. seeds (N,): 0 for the prediction. variety: size of the deviations.
    detail: whether details are added.
    """

    asked: WalkerTake
    seeds: Annotated[Indices, "motions"]
    variety: float
    detail: bool

    def facts(self) -> dict[str, Any]:
        """Return the facts about the takes, as plain values."""
        return {"seed": self.asked, "variety": self.variety, "detail": self.detail}


@dataclass(frozen=True)
class _Deviations:
    """Deviations of chosen characters (M,) of a plan, all in its frames.

    coefficients: (M, F, r3), uncorrelated. details: (M, T, r1); None without.
    """

    chosen: Annotated[Indices, "motions"]
    coefficients: Annotated[Floats, "motions frames modes"]
    details: Annotated[Floats, "motions canonical freedoms"] | None

    def detail_rows(
        self, rows: Annotated[Indices, "poses"], places: Annotated[Floats, "poses"]
    ) -> Annotated[Floats, "poses freedoms"]:
        """Return the details (K, r1) of characters by row (K,) at canonical frames (K,)."""
        if self.details is None:
            return np.zeros((len(rows), 1))
        before = np.minimum(places.astype(np.int64), self.details.shape[1] - 2)
        share = (places - before)[:, None]
        first, second = self.details[rows, before], self.details[rows, before + 1]
        return np.asarray((1.0 - share) * first + share * second)


def of_order(card: ModelCard, order: CrowdOrder) -> WalkerTakes | None:
    """Return the takes of an order, or None for the prediction.

    Detail is off for a model whose file has none. Raises InvalidField for a seed or a variety out
    of range, and for a model without takes.
    """
    taken, count = order.take, order.motions or order.count
    if taken != "index" and not 0 <= taken <= MAX_TAKE:
        raise InvalidField("take", f"{taken}, expected 'index' or 0 to {MAX_TAKE}")
    if not 0.0 <= order.variety <= 1.0:
        raise InvalidField("variety", f"{order.variety:g}, expected 0 to 1")
    if taken and not random_field.has_features(card.kriging):
        found = card.kriging.covariance
        raise InvalidField("take", f"{taken!r}, but no takes can be drawn of {found} kriging")
    detail = order.detail and bool(card.making.detail)
    if not (taken or detail):
        return None
    seeds = 1 + np.arange(count) if taken == "index" else np.full(count, taken)
    return WalkerTakes(taken, seeds, order.variety, detail)


def pose_maker(
    model: Synthesizer, takes: WalkerTakes, plan: LocomotionPlan, who: Indices
) -> PoseMaker:
    """Return what computes poses of takes of characters (M,) of a plan, in ascending order."""
    found = _deviations(model, takes, plan, who)

    def pose(
        session: Session, plan: LocomotionPlan, who: Indices, frames: Indices, level: int
    ) -> RelativePoses:
        own = _relative_poses(model, found, plan, (who, frames), level)
        return locomotion_plan.place_poses(plan, (who, frames), own)

    return pose


def _deviations(
    model: Synthesizer, takes: WalkerTakes, plan: LocomotionPlan, who: Indices
) -> _Deviations:
    seeds = takes.seeds[who]
    by = deviations_along(model, plan, who, seeds, KNOT_SECONDS)
    details = model.solver.variation.details(seeds) if takes.detail else None
    return _Deviations(who, takes.variety * by, details)


def deviations_along(
    model: Synthesizer,
    plan: LocomotionPlan,
    who: Annotated[Indices, "motions"],
    seeds: Annotated[Indices, "motions"],
    apart: float,
) -> Annotated[Floats, "motions frames modes"]:
    """Return uncorrelated deviations (M, F, r3) of takes along the paths of characters (M,).

    seeds: (M,). apart: interval of the points at which they are computed, s, with lines between.
    """
    frames = plan.controls.shape[1]
    knots = np.append(np.arange(0, frames - 1, max(1, int(apart * plan.rate))), frames - 1)
    labels = plan.labels.weights[plan.who[who]]
    by = model.solver.variation.along_paths(plan.controls[who][:, knots], labels, seeds)
    places = np.interp(np.arange(frames), knots, np.arange(len(knots)))
    before = np.minimum(places.astype(np.int64), max(len(knots) - 2, 0))
    after, share = np.minimum(before + 1, len(knots) - 1), (places - before)[:, None]
    return np.asarray((1.0 - share) * by[:, before] + share * by[:, after])


def _relative_poses(
    model: Synthesizer,
    found: _Deviations,
    plan: LocomotionPlan,
    pair: tuple[Indices, Indices],
    level: int,
) -> RelativePoses:
    """Return K poses relative to the travel, of pairs of a character (K,) and a frame (K,)."""
    labels, phases = plan.labels.weights[plan.who[pair[0]]], plan.phases[pair]
    own = stride.strides(model.session, plan.controls[pair], labels, level)
    bench = model.solver.corrector(level)
    rows = np.searchsorted(found.chosen, pair[0])
    posed = [np.empty((len(phases), *shape)) for shape in _shapes(model.session.card)]
    for part in stride.batches(len(phases)):
        cancellation.check()
        times = (phases[part] * own.durations[part])[:, None]
        given = plan.controls[pair][part], times, labels[part]
        coefficients, places, travel = model.session.states(*given, level)
        by = found.coefficients[rows[part], pair[1][part]]
        moved = take_variation.change_coefficients(bench, by)
        coefficients[:, : moved.shape[1]] += moved
        moves = bench.reduced.moves_of_coefficients(coefficients, places)
        moves += found.detail_rows(rows[part], places)[:, : moves.shape[1]]
        for whole, values in zip(posed, _poses(bench.reduced, moves, places, travel), strict=True):
            whole[part] = values
    rotations, roots, values = posed
    relative = stride.relative_poses(own, phases, rotations, roots)
    return replace(relative, curves=values) if values.shape[1] else relative


def _shapes(card: ModelCard) -> list[tuple[int, ...]]:
    """Return the shapes of rotations, root position and curves of one pose."""
    return [(len(card.skeleton), 4), (3,), (len(card.curves),)]


def _poses(
    reduced: ReducedTensor,
    moves: Annotated[Floats, "poses freedoms"],
    places: Annotated[Floats, "poses"],
    travel: Annotated[Floats, "poses 3"],
) -> tuple[
    Annotated[Floats, "poses joints 4"],
    Annotated[Floats, "poses 3"],
    Annotated[Floats, "poses curves"],
]:
    """Return rotations (K, J, 4), root positions (K, 3), m, and curves (K, C), with travel."""
    rotations, roots, values = reduced.poses_of_moves(moves)
    gone = (places / (reduced.frames - 1))[:, None] * travel
    return *root_travel.add_travel(rotations, roots, gone), values
