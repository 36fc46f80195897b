"""Statistics of residuals that takes are drawn from: of a cycle's travel, and of its detail."""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.array_shapes import ClipPositions, PerClip
from posefield.common.units import Floats
from posefield.inference import motion_detail
from posefield.inference.motion_detail import Deviations
from posefield.model_file.model_card import ModelCard, rounded
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_kriging
from posefield_train.tensor import truncation_error
from posefield_train.tensor.hosvd import TuckerTensor

MAX_HARMONICS = 30
"""Harmonics of the detail. Thirty reach 97 % of a walk's acceleration."""
DRAWS, ROUNDS = 2, 3
"""Draws of each clip and rounds of the search for the gain."""
JITTER = 1e-9
"""Added to a covariance that clips of one duration or without turns make singular."""


@dataclass(frozen=True)
class DetailFit:
    """Detail of a cycle.

    deviations: of the harmonics, with the gain. without, sampled: acceleration of left-out
    predictions over that of captured clips, without detail and with it.
    """

    deviations: Deviations
    without: float
    sampled: float

    @property
    def facts(self) -> dict[str, float]:
        """Return the facts of the model card."""
        harmonics, directions = self.deviations.shape
        sizes = {"harmonics": harmonics, "directions": directions}
        return sizes | {"acceleration": rounded(self.without), "sampled": rounded(self.sampled)}


@dataclass(frozen=True)
class TakeStatistics:
    """Statistics of the takes of a model. root: `take_root`. detail: None for none."""

    root: tuple[tuple[float, ...], ...] = ()
    detail: DetailFit | None = None

    def on_card(self, card: ModelCard) -> ModelCard:
        """Return the card with the statistics; unchanged for a motion without cycle."""
        if not self.root:
            return card
        stored = motion_detail.to_bytes(self.detail.deviations) if self.detail else b""
        facts = {"detail": self.detail.facts} if self.detail else {}
        return replace(
            card,
            making=replace(card.making, take_root=self.root, detail=stored),
            diagnostics={**card.diagnostics, **facts},
        )


def estimate(trained: TrainedModel) -> TakeStatistics:
    """Return the statistics of a trained model."""
    return TakeStatistics(take_root(trained), fit_detail(trained))


def take_root(trained: TrainedModel) -> tuple[tuple[float, ...], ...]:
    """Return the last rows (4, r3 + 4) of a root of the covariance of residuals.

    The residuals are those of the coefficients, then of log duration and travel, scaled to a sigma
    of one metre. Empty for motions without cycle. With it a take's steps and its travel agree.
    """
    if "travel" not in trained.residuals:
        return ()
    beside = np.hstack([trained.residuals["duration"], trained.residuals["travel"]])
    strays = np.hstack([_left_out(trained) @ trained.model.decoder.reduced.bases[2], beside])
    standard = strays / np.sqrt(trained.model.bank.sill * trained.pose.variances)[:, None]
    covariance = standard.T @ standard / len(standard)
    sizes = np.sqrt(np.diagonal(covariance)) + JITTER
    root = np.linalg.cholesky(covariance / np.outer(sizes, sizes) + JITTER * np.eye(len(sizes)))
    rows = (sizes[:, None] * root)[-beside.shape[1] :]
    return tuple(tuple(map(rounded, row)) for row in rows)


def fit_detail(trained: TrainedModel) -> DetailFit | None:
    """Return the detail of a cycle; None for other motions, and where none is missing.

    Its gain makes the acceleration of left-out predictions that of the captured clips.
    """
    if "travel" not in trained.residuals:
        return None
    found = _harmonic_deviations(trained)
    captured = _accelerations(trained, trained.tensor.values).mean()
    predicted = _predictions(trained)
    without = _accelerations(trained, predicted).mean() / captured
    gain = reached = 1.0
    for _ in range(ROUNDS):
        drawn = [_sampled(trained, predicted, gain * found, draw) for draw in range(DRAWS)]
        reached = float(np.mean([_accelerations(trained, own).mean() for own in drawn])) / captured
        if without >= 1.0 or reached <= without:
            return None
        last, gain = gain, gain * np.sqrt((1.0 - without**2) / (reached**2 - without**2))
    return DetailFit(last * found, float(without), reached)


def _left_out(trained: TrainedModel) -> Floats:
    """Return the matrix (N, N) from sample values to leave-one-out residuals."""
    return sample_kriging.leave_out(trained.pose.hyper, trained.samples)


def _predictions(trained: TrainedModel) -> Floats:
    """Return the left-out predictions (D', T, N) of the finest level."""
    first, times, samples = trained.model.decoder.reduced.bases
    predicted = samples - _left_out(trained) @ samples
    return TuckerTensor(trained.model.decoder.reduced.core, (first, times, predicted)).restored()


def _harmonic_deviations(trained: TrainedModel) -> Deviations:
    """Return standard deviations (H, r1) of the residuals' harmonics, pooled over all clips.

    Of the part alone that the time functions cannot follow: takes vary the rest.
    """
    first, times, _ = trained.model.decoder.reduced.bases
    missed = np.tensordot(first.T, trained.full.slices(trained.pose.residuals), axes=1)
    missed = missed - np.einsum("dtn,tk,sk->dsn", missed, times, times)
    # The last frame is the first one of the next cycle.
    period = missed.shape[1] - 1
    harmonics = min(MAX_HARMONICS, (period - 1) // 2)
    waves = motion_detail.waves(period + 1, harmonics)[:-1]
    parts = 2.0 / period * np.einsum("dtn,tw->wdn", missed[:, :-1], waves)
    powers = np.mean(np.square(parts), axis=2).reshape(2, harmonics, -1)
    return np.asarray(np.sqrt(powers.mean(axis=0)))


def _sampled(trained: TrainedModel, predicted: Floats, found: Deviations, draw: int) -> Floats:
    """Return predictions (D', T, N) with detail, a seed of its own for each clip and draw."""
    frames, clips = predicted.shape[1:]
    seeds = 1 + draw * clips + np.arange(clips)
    detail = [motion_detail.sample(found, frames, int(seed)) for seed in seeds]
    first = trained.model.decoder.reduced.bases[0]
    return predicted + np.tensordot(first, np.stack(detail, axis=2), axes=(1, 1))


def _accelerations(trained: TrainedModel, values: Floats) -> PerClip:
    """Return the mean acceleration (N,), m/s², of the joints relative to the root.

    values: whitened, on canonical time (D', T, N), which is taken as even time.
    """
    parents = trained.skeleton.parents
    offsets = np.stack([example.offsets for example in trained.examples])
    points = truncation_error.positions(trained.tensor, values, parents, offsets)
    joints: ClipPositions = points[:, :, : len(parents)]
    second = np.diff(joints - joints[:, :, :1], 2, axis=1)
    rates = (values.shape[1] - 1) / trained.aligned.durations
    return np.asarray(np.mean(np.linalg.norm(second, axis=-1), axis=(1, 2)) * rates**2)
