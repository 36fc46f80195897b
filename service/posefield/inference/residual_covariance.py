"""Covariance of the residuals of captured motions: the metric of a correction.

The residuals are standardised leave-one-out errors of the captured clips. For a Gaussian
conditioned on a target, the least change in this metric is the most probable one. Few residuals
leave most directions undetermined, so the covariance is shrunk towards the Kronecker product of its
marginals over time and degrees of freedom, which keeps corrections smooth in time.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerSample, Samples
from posefield.common.units import Floats, Indices
from posefield.inference.reduced_motion import GraphConstants, ReducedTensor
from posefield.kriging import kriging_model, leave_one_out
from posefield.model_file.model_card import ModelCard

# Weight of the marginals. On real motion, weights from 0.3 to 1 are equally accurate; smaller ones
# are less smooth.
MARGINAL_WEIGHT = 0.7


@dataclass(frozen=True)
class ResidualCovariance:
    """Covariance of a reduced motion (r2, r1) and of the variables beside it.

    All for a sigma of one metre. residuals: (r2 r1, r3), a root of the covariance of residuals.
    coefficients: (r3, r3), the same for the sample coefficients, lower triangular.
    time: (r2, r2) and freedoms: (r1, r1), its marginals, their product scaled to its trace. beside:
    (b, b), covariance of the logarithm of the duration and of a cycle's travel; empty for motions
    without cycles. captured: (n, r2 r1), reduced motions of the captured clips. predicted: (n, r2
    r1), their leave-one-out predictions. sigmas: (n,), standard deviations of the predictions, m,
    times the root of n.
    """

    residuals: Annotated[Floats, "reduced modes"]
    coefficients: Annotated[Floats, "modes modes"]
    time: Annotated[Floats, "times times"]
    freedoms: Annotated[Floats, "freedoms freedoms"]
    beside: Annotated[Floats, "beside beside"]
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
        own = (inner @ self.residuals) @ self.residuals.T
        both = MARGINAL_WEIGHT * even + (1.0 - MARGINAL_WEIGHT) * own
        beside = gradients[..., len(self.residuals) :] @ self.beside
        return np.concatenate([both, beside], axis=-1).swapaxes(-1, -2)


def estimate(
    card: ModelCard, weights: GraphConstants, samples: Samples, reduced: ReducedTensor
) -> ResidualCovariance:
    """Return the covariance for a model's level.

    samples: (n, d + p), points of the captured clips. Their coefficients are recovered from the
    dual weights: the kriging system times the weights gives the samples.
    """
    hyper = card.kriging
    left_out = leave_one_out.leave_out(hyper, samples, leave_out_groups(card, samples))
    variances = leave_one_out.left_out_variances(hyper, samples, left_out)
    sill = weights["sill"].item()
    # What the second prediction around the event adds is given, and is no part of a correction.
    core = reduced.core[..., : card.levels[0].ranks[2]]
    r3 = core.shape[2]
    held = sample_coefficients(card, weights, samples)[:, :r3]
    missed = left_out @ held
    sigmas = np.sqrt(sill * variances * len(samples))
    # Residuals for a sigma of one metre: times the sigma of a point they are those of the point.
    strays = missed / sigmas[:, None]
    root = np.linalg.cholesky(strays.T @ strays + 1e-12 * np.eye(r3))
    spread = core @ root
    time = np.einsum("tdk,sdk->ts", spread, spread)
    freedoms = np.einsum("tdk,tek->de", spread, spread)
    own = np.array(card.beside, dtype=float).reshape(len(card.beside), len(card.beside))
    marginals = time / np.trace(time), freedoms
    flat = core.reshape(-1, r3).T
    motions = held @ flat, (held - missed) @ flat
    roots = spread.reshape(-1, r3), root
    return ResidualCovariance(*roots, *marginals, own @ own.T, *motions, sigmas)


def sample_coefficients(
    card: ModelCard, weights: GraphConstants, samples: Samples
) -> Annotated[Floats, "samples modes"]:
    """Return the sample coefficients (n, r3) of the captured clips, in the card's order."""
    hyper = card.kriging
    r3 = weights["core"].shape[2]
    order = importance_order(card, weights, samples)
    held = samples[order]
    dual = weights["pose_weights"][:, :r3].astype(np.float64)
    # The event's columns come last.
    first = weights["linear_weights"].shape[1] - r3 - card.levels[0].event
    linear = weights["linear_weights"][:, first : first + r3].astype(np.float64)
    found = np.empty((len(samples), r3))
    near = kriging_model.stationary_covariances(hyper, held, held)
    near += hyper.nugget * np.eye(len(held))
    found[order] = near @ dual + kriging_model.linear_functions(hyper, held) @ linear
    return found


def importance_order(
    card: ModelCard, weights: GraphConstants, samples: Samples
) -> Annotated[Indices, "samples"]:
    """Return the index on the card (n,) of each sample, in the file's order of importance."""
    held = weights["samples"].T
    listed = samples[:, : len(card.controls)].astype(np.float32)
    graph_names = [weights[f"whose_{index}"] for index in range(len(card.labels))]
    card_names = [own.clips for own in card.labels]
    place = np.empty(len(held), dtype=np.int64)
    place[np.lexsort((*held.T, *graph_names))] = np.lexsort((*listed.T, *card_names))
    return place


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
    found = card.making.takes or np.unique(files, return_inverse=True)[1]
    return np.asarray(found, dtype=np.int64)
