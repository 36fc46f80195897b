"""Reduced tensor of a model file, poses of a reduced motion, and covariance of its residuals.

Deviations of a cycle are harmonics that no control predicts, sampled by a seed. Averages over clips
lose them, and with them much of a walk's acceleration.

The residuals are standardised leave-one-out errors of the captured clips. For a Gaussian
conditioned on a target, the least change in this metric is the most probable one. Few residuals
leave most directions undetermined, so the covariance is shrunk towards the Kronecker product of its
marginals over time and degrees of freedom, which keeps corrections smooth in time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import (
    Bones,
    Floats,
    Frames,
    Indices,
    JointRotations,
    PerSample,
    RootPath,
    Rotations,
    Samples,
)
from posefield.kriging import kriging_model, random_field
from posefield.kriging.random_field import Seeds
from posefield.model_file.model_card import Level, ModelCard
from posefield.motion import curves, quat
from posefield.motion.curves import Curve
from posefield.motion.quat import CHARTS, ChartName

STREAM = 3
"""Stream of a seed, besides those of `random_field`."""

Deviations = Annotated[Floats, "harmonics freedoms"]


def deviations(card: ModelCard) -> Deviations:
    """Return standard deviations (H, r1) of the harmonics' coefficients; H is 0 without detail."""
    stored = np.frombuffer(card.making.detail, dtype="<f2").astype(np.float64)
    return stored.reshape(-1, card.levels[0].ranks[0])


def to_bytes(deviations: Deviations) -> bytes:
    """Return the deviations as a card stores them: half precision, row by row."""
    return deviations.astype("<f2").tobytes()


def waves(frames: int, harmonics: int) -> Annotated[Floats, "frames waves"]:
    """Return cosines and sines (T, 2 H) of a cycle, whose last frame is its first again."""
    angles = 2.0 * np.pi * np.arange(frames)[:, None] / (frames - 1) * np.arange(1, harmonics + 1)
    return np.hstack([np.cos(angles), np.sin(angles)])


def sample(
    deviations: Deviations, frames: int, seed: Seeds
) -> Annotated[Floats, "*seeds frames freedoms"]:
    """Return the detail (..., T, r1) of each seed: equal for all controls and labels."""
    harmonics, freedoms = deviations.shape
    normals = random_field.normals(seed, STREAM, 2 * harmonics, freedoms)
    return np.asarray(waves(frames, harmonics) @ (normals * np.vstack([deviations, deviations])))


GraphConstants = Mapping[str, npt.NDArray[Any]]
"""Constants of a model's graph by name."""


@dataclass(frozen=True)
class ReducedTensor:
    """Core and bases of one level of detail.

    core: (r2, r1, r3), modes of time, degrees of freedom and samples. time: (T, r2). directions:
    (r1, D) and mean: (D,), pose vectors of the root's position and three numbers for each joint's
    rotation about its mean, and then of the curves. rotations: mean rotations (J, 4). chart: of
    the numbers of rotations. curves: of the family. detail (T, r1): added to the moves of every
    motion; None for none.
    """

    core: Annotated[Floats, "times freedoms modes"]
    time: Annotated[Floats, "frames times"]
    directions: Annotated[Floats, "freedoms dof"]
    mean: Annotated[Floats, "dof"]
    rotations: JointRotations
    chart: ChartName
    curves: tuple[Curve, ...] = ()
    detail: Annotated[Floats, "frames freedoms"] | None = None

    @property
    def frames(self) -> int:
        """Number of canonical frames T."""
        return len(self.time)

    def motion(
        self, coefficients: Annotated[Floats, "modes"]
    ) -> Annotated[Floats, "times freedoms"]:
        """Return the reduced motion (r2, r1) of sample coefficients (r3,)."""
        return self.core @ coefficients

    def row(self, frame: float) -> Annotated[Floats, "times"]:
        """Return the time coefficients (r2,) at a canonical frame, interpolated linearly."""
        before = min(int(frame), self.frames - 2)
        share = frame - before
        interpolated: Floats = (1.0 - share) * self.time[before] + share * self.time[before + 1]
        return interpolated

    def rows(self, frames: Frames) -> Annotated[Floats, "frames times"]:
        """Return the time coefficients (S, r2) at canonical frames (S,)."""
        return quat.interpolate_rows(self.time, frames)

    def moves(
        self, motion: Annotated[Floats, "times freedoms"], frames: Frames
    ) -> Annotated[Floats, "frames freedoms"]:
        """Return the coefficients (S, r1) of the directions in a reduced motion (r2, r1)."""
        return self.with_detail(self.rows(frames) @ motion, frames)

    def moves_of_coefficients(
        self, coefficients: Annotated[Floats, "poses modes"], frames: Annotated[Floats, "poses"]
    ) -> Annotated[Floats, "poses freedoms"]:
        """Return the coefficients (S, r1) of the directions of poses of motions of their own.

        coefficients: sample coefficients (S, r3) of each motion. frames: canonical frames (S,).
        """
        r2, r1, r3 = self.core.shape
        motions = coefficients @ self.core.reshape(r2 * r1, r3).T
        products = self.rows(frames)[:, None] @ motions.reshape(-1, r2, r1)
        return np.asarray(products[:, 0])

    def with_detail(
        self, moves: Annotated[Floats, "frames freedoms"], frames: Frames
    ) -> Annotated[Floats, "frames freedoms"]:
        """Return moves (S, r1) at canonical frames (S,) with the detail added."""
        return moves if self.detail is None else moves + quat.interpolate_rows(self.detail, frames)

    def poses(
        self, motion: Annotated[Floats, "times freedoms"], frames: Frames
    ) -> tuple[Rotations, RootPath]:
        """Return rotations (S, J, 4) and root positions (S, 3), m, of a reduced motion (r2, r1)."""
        products, roots = self.turn_products(motion, frames)
        return self.rotations_of(products), roots

    def turns(self, numbers: Annotated[Floats, "poses dof"]) -> Rotations:
        """Return rotations (S, J, 4) of pose vectors (S, D)."""
        charts = numbers[:, 3 : 3 + 3 * len(self.rotations)].reshape(len(numbers), -1, 3)
        return quat.mul(self.rotations, CHARTS[self.chart].quaternions(charts))

    def joint_turns(
        self, moves: Annotated[Floats, "frames freedoms"], joints: Sequence[int]
    ) -> Annotated[Floats, "frames some 4"]:
        """Return the local rotations (S, H, 4) of joints, from coefficients (S, r1) of moves."""
        rows = np.ravel(3 + 3 * np.array(joints, int)[:, None] + np.arange(3))
        numbers = self.mean[rows] + moves @ self.directions[:, rows]
        charts = numbers.reshape(len(moves), len(joints), 3)
        return quat.mul(self.rotations[list(joints)], CHARTS[self.chart].quaternions(charts))

    def turn_products(
        self, motion: Annotated[Floats, "times freedoms"], frames: Frames
    ) -> tuple[Annotated[Floats, "frames joints 4"], RootPath]:
        """Return what `rotations_of` needs (S, J, 4), and root positions (S, 3), m.

        The former are linear in the reduced motion (r2, r1), by products of one motion.
        """
        moves = self.moves(motion, frames)
        mean, turns = self.mean_products
        return (mean + moves @ turns).reshape(len(frames), -1, 4), self._roots(moves)

    def roots(self, motion: Annotated[Floats, "times freedoms"], frames: Frames) -> RootPath:
        """Return the root positions (S, 3), m, of a reduced motion (r2, r1)."""
        return self._roots(self.moves(motion, frames))

    def rotations_of(
        self, products: Annotated[Floats, "poses joints 4"]
    ) -> Annotated[Floats, "poses joints 4"]:
        """Return rotations (S, J, 4) of mean rotations times the chart's share of the numbers.

        products: (S, J, 4), as long as the share of the numbers; they are overwritten.
        """
        squares = np.einsum("njk,njk->nj", products, products)
        real, factor = CHARTS[self.chart].terms(squares)
        products *= factor[..., None]
        products += real[..., None] * self.rotations
        return products

    def _roots(self, moves: Annotated[Floats, "frames freedoms"]) -> RootPath:
        return np.asarray(self.mean[:3] + moves @ self.directions[:, :3])

    def poses_of_moves(
        self, moves: Annotated[Floats, "poses freedoms"]
    ) -> tuple[
        Annotated[Floats, "poses joints 4"],
        Annotated[Floats, "poses 3"],
        Annotated[Floats, "poses curves"],
    ]:
        """Return rotations (S, J, 4), root positions (S, 3), m, and values (S, C) of the curves.

        moves: coefficients (S, r1) of the directions.
        """
        root_and_curves = np.r_[:3, 3 + 3 * len(self.rotations) : len(self.mean)]
        numbers = self.mean[root_and_curves] + moves @ self.directions[:, root_and_curves]
        mean, turns = self.mean_products
        rotations = self.rotations_of((mean + moves @ turns).reshape(len(moves), -1, 4))
        return rotations, numbers[:, :3], curves.clamp(self.curves, numbers[:, 3:])

    @cached_property
    def mean_products(
        self,
    ) -> tuple[Annotated[Floats, "joints_4"], Annotated[Floats, "freedoms joints_4"]]:
        """Return mean rotations times the chart's share of the numbers (J 4): mean, by direction.

        They are linear in the moves, and as long as the share of the numbers.
        """
        end, joints = 3 + 3 * len(self.rotations), len(self.rotations)
        numbers = np.vstack([self.mean, self.directions])[:, 3:end]
        rows = CHARTS[self.chart].share * numbers.reshape(-1, joints, 3)
        products = quat.mul(self.rotations, np.pad(rows, ((0, 0), (0, 0), (1, 0))))
        flat = products.reshape(len(rows), -1)
        return flat[0], flat[1:]

    def curve_values(
        self, motion: Annotated[Floats, "times freedoms"], frames: Frames
    ) -> Annotated[Floats, "frames curves"]:
        """Return the values (S, C) of the curves in a reduced motion (r2, r1)."""
        curve_rows = slice(3 + 3 * len(self.rotations), None)
        numbers = (
            self.mean[curve_rows] + self.moves(motion, frames) @ self.directions[:, curve_rows]
        )
        return curves.clamp(self.curves, numbers)


def read(weights: GraphConstants, level: Level, card: ModelCard) -> ReducedTensor:
    """Return the reduced tensor of a level; KeyError for a missing constant.

    card: tells the chart and the curves.
    """
    own_curves, chart = card.curves, card.making.chart
    r1, r2, r3 = level.ranks
    rotations = weights["mean_rotations"][:, :, 0].astype(np.float64)
    moves = np.zeros((1 + len(rotations), 1))
    moves[[0, *(1 + joint for joint in level.joints)]] = 1.0
    affine = np.concatenate([np.repeat(moves, 3, axis=0), np.ones((len(own_curves), 1))])
    directions = _directions(weights)[:, :r1] * affine
    mean = [weights["root_mean"], _mean_turns(weights, rotations, chart).ravel()]
    core = weights["core"][:r2, :r1, :r3].astype(np.float64)
    time = weights["time_basis"][:r2].T.astype(np.float64)
    if level.event:
        core = _with_event(core, weights["event_mixing"].astype(np.float64), level.event)
        time = np.hstack([time, weights["event_times"].T.astype(np.float64)])
    return ReducedTensor(
        core,
        time,
        directions.T.copy(),
        np.concatenate([*mean, *([weights["curve_mean"]] if own_curves else [])]),
        rotations,
        chart,
        own_curves,
    )


def _with_event(
    core: Annotated[Floats, "times freedoms modes"],
    mixing: Annotated[Floats, "columns times"],
    count: int,
) -> Annotated[Floats, "more_times freedoms more_modes"]:
    """Return the core with the block that the event's second prediction multiplies."""
    columns, (r2, _, r3) = len(mixing), core.shape
    extended = np.pad(core, ((0, columns), (0, 0), (0, count)))
    extended[r2:, :, r3:] = np.tensordot(mixing, core[:, :, :count], axes=1)
    return extended


def _directions(weights: GraphConstants) -> Annotated[Floats, "dof freedoms"]:
    """Return the directions (D, r1), with zeros for degrees of freedom that never vary."""
    stored = weights["directions"]
    padded = np.vstack([stored, np.zeros((1, stored.shape[1]))])
    directions: Floats = padded[weights["freedoms"]].astype(np.float64)
    return directions


def _mean_turns(weights: GraphConstants, rotations: JointRotations, chart: ChartName) -> Bones:
    """Return the mean numbers (J, 3); the graph stores their products with the mean rotations."""
    turned = weights["rotation_mean"].reshape(-1, 4).astype(np.float64)
    if "joint_order" in weights:
        turned = turned[np.argsort(weights["joint_order"])]
    return quat.mul(quat.conj(rotations), turned)[:, 1:] / CHARTS[chart].share


# Weight of the marginals. On real motion, weights from 0.3 to 1 are equally accurate; smaller ones
# are less smooth.
MARGINAL_WEIGHT = 0.7


@dataclass(frozen=True)
class ResidualCovariance:
    """Covariance of a reduced motion (r2, r1) and of the variables beside it.

    All for a sigma of one metre. residuals: (r2 r1, r3), a root of the covariance of residuals.
    coefficients: (r3, r3), the same for the sample coefficients, lower triangular.
    time: (r2, r2) and freedoms: (r1, r1), its marginals, their product scaled to its trace. cycle:
    (b, b), covariance of the logarithm of the duration and of a cycle's travel; empty for motions
    without cycles. captured: (n, r2 r1), reduced motions of the captured clips. predicted: (n, r2
    r1), their leave-one-out predictions. sigmas: (n,), standard deviations of the predictions, m,
    times the root of n.
    """

    residuals: Annotated[Floats, "reduced modes"]
    coefficients: Annotated[Floats, "modes modes"]
    time: Annotated[Floats, "times times"]
    freedoms: Annotated[Floats, "freedoms freedoms"]
    cycle: Annotated[Floats, "cycle cycle"]
    captured: Annotated[Floats, "samples reduced"]
    predicted: Annotated[Floats, "samples reduced"]
    sigmas: PerSample

    def apply_shrunk(
        self, gradients: Annotated[Floats, "*motions values variables"]
    ) -> Annotated[Floats, "*motions variables values"]:
        """Return the shrunk covariance times gradients (..., k, r2 r1 + b): (..., r2 r1 + b, k)."""
        inner = gradients[..., : len(self.residuals)]
        r2, r1 = len(self.time), len(self.freedoms)
        blocks = self.time @ inner.reshape(*inner.shape[:-1], r2, r1) @ self.freedoms
        even = blocks.reshape(inner.shape)
        explained = (inner @ self.residuals) @ self.residuals.T
        both = MARGINAL_WEIGHT * even + (1.0 - MARGINAL_WEIGHT) * explained
        other_quantities = gradients[..., len(self.residuals) :] @ self.cycle
        return np.concatenate([both, other_quantities], axis=-1).swapaxes(-1, -2)


def estimate(
    card: ModelCard, weights: GraphConstants, samples: Samples, reduced: ReducedTensor
) -> ResidualCovariance:
    """Return the covariance for a model's level.

    samples: (n, d + p), points of the captured clips. Their coefficients are recovered from the
    dual weights: the kriging system times the weights gives the samples.
    """
    hyper = card.kriging
    left_out = kriging_model.leave_out(hyper, samples, leave_out_groups(card, samples))
    variances = kriging_model.left_out_variances(hyper, samples, left_out)
    sill = weights["sill"].item()
    # What the second prediction around the event adds is given, and is no part of a correction.
    core = reduced.core[..., : card.levels[0].ranks[2]]
    r3 = core.shape[2]
    coefficients = sample_coefficients(card, weights, samples)[:, :r3]
    residuals = left_out @ coefficients
    sigmas = np.sqrt(sill * variances * len(samples))
    # Residuals for a sigma of one metre: times the sigma of a point they are those of the point.
    strays = residuals / sigmas[:, None]
    root = np.linalg.cholesky(strays.T @ strays + 1e-12 * np.eye(r3))
    spread = core @ root
    time = np.einsum("tdk,sdk->ts", spread, spread)
    freedoms = np.einsum("tdk,tek->de", spread, spread)
    other_covariance = np.array(card.beside, dtype=float).reshape(
        len(card.beside), len(card.beside)
    )
    marginals = time / np.trace(time), freedoms
    flat = core.reshape(-1, r3).T
    motions = coefficients @ flat, (coefficients - residuals) @ flat
    roots = spread.reshape(-1, r3), root
    return ResidualCovariance(
        *roots, *marginals, other_covariance @ other_covariance.T, *motions, sigmas
    )


def sample_coefficients(
    card: ModelCard, weights: GraphConstants, samples: Samples
) -> Annotated[Floats, "samples modes"]:
    """Return the sample coefficients (n, r3) of the captured clips, in the card's order."""
    hyper = card.kriging
    r3 = weights["core"].shape[2]
    order = importance_order(card, weights, samples)
    ordered = samples[order]
    dual = weights["pose_weights"][:, :r3].astype(np.float64)
    # The event's columns come last.
    first = weights["linear_weights"].shape[1] - r3 - card.levels[0].event
    linear = weights["linear_weights"][:, first : first + r3].astype(np.float64)
    coefficients = np.empty((len(samples), r3))
    near = kriging_model.stationary_covariances(hyper, ordered, ordered)
    near += hyper.nugget * np.eye(len(ordered))
    coefficients[order] = near @ dual + kriging_model.linear_functions(hyper, ordered) @ linear
    return coefficients


def importance_order(
    card: ModelCard, weights: GraphConstants, samples: Samples
) -> Annotated[Indices, "samples"]:
    """Return the index on the card (n,) of each sample, in the file's order of importance."""
    rows = weights["samples"].T
    listed = samples[:, : len(card.controls)].astype(np.float32)
    graph_names = [weights[f"whose_{index}"] for index in range(len(card.labels))]
    card_names = [label.clips for label in card.labels]
    order_of = np.empty(len(rows), dtype=np.int64)
    order_of[np.lexsort((*rows.T, *graph_names))] = np.lexsort((*listed.T, *card_names))
    return order_of


def leave_out_groups(card: ModelCard, samples: Samples) -> Annotated[Indices, "samples"]:
    """Return indices (n,) of the groups of captured clips that are left out together.

    Clips of one take form a group; each clip is a group of its own if the other groups could not
    determine the drift.
    """
    hyper, takes = card.kriging, take_numbers(card)
    functions = kriging_model.drift(samples, len(card.controls), max(hyper.drifts))
    if kriging_model.find_required_group(takes, functions) is not None:
        return np.arange(len(samples))
    return takes


def take_numbers(card: ModelCard) -> Annotated[Indices, "samples"]:
    """Return the number (N,) of each captured clip's take; without takes, of its file."""
    files = [source.partition(", frames ")[0] for source in card.sources]
    numbers = card.making.takes or np.unique(files, return_inverse=True)[1]
    return np.asarray(numbers, dtype=np.int64)
