"""Examples to a model: align, tensor, HOSVD, kriging."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from model_export import align, hosvd, kriging, ranks, tensor, travel, tune
from model_export.align import Aligned
from model_export.decoder import Decoder, Proportions
from model_export.field_bank import Constant, Field, FieldBank, Spread
from model_export.flips import Finding, without_jumps
from model_export.hosvd import Multilinear
from model_export.ingest import Example
from model_export.model import Model
from model_export.recipe import Recipe
from model_export.tensor import MotionTensor
from model_export.timing import Timing
from model_export.travel import Travel
from model_export.tune import Tuned
from model_export.warp import WarpBasis
from service.motion.conventions import Floats
from service.motion.skeleton import Skeleton

Report = Callable[[str], None]
"""Is told what is being done, in a few words."""

# Bone offsets that a model cannot tell apart, m.
SAME_BONE = 5e-4


@dataclass(frozen=True)
class Trained:
    """A model with what it was made from and what was seen on the way.

    pose: the tuned pose field. missed (N,): mean squared joint distance, m², of each clip from what
    all others predict for it. explained: for each field the share of the variation between clips
    that leave-one-out predicts from the controls; one at or below zero is answered with its mean.
    """

    model: Model
    skeleton: Skeleton
    aligned: Aligned
    tensor: MotionTensor
    full: Multilinear
    pose: Tuned
    missed: Floats
    explained: dict[str, float]
    findings: list[Finding]


def train(recipe: Recipe, examples: Sequence[Example], report: Report) -> Trained:
    """Model of a recipe's examples.

    Raises TrainingError where the samples cannot carry a field.
    """
    controls = np.stack([example.controls for example in examples])
    names = tuple(control.name for control in recipe.controls)
    kriging.check(controls, names, recipe.kriging.drift, recipe.kriging.nugget == 0)
    examples, findings = _clean(examples)
    weights = _joint_weights(recipe, examples)
    basis = WarpBasis(recipe.alignment.knots)
    report(f"aligning {len(examples)} clips")
    aligned = align.align(examples, recipe.motion.frames, basis, recipe.alignment.rounds, weights)
    offsets = np.stack([example.offsets for example in examples])
    report("building the motion tensor")
    parents = examples[0].clip.skeleton.parents
    others: dict[str, Floats] = {}
    if recipe.motion.cyclic:
        aligned, others["travel"] = travel.take_out(aligned)
    numbers, own_chart, noticed = tensor.pose_vectors(aligned, parents, offsets)
    own_tensor = tensor.build(numbers, own_chart, parents, offsets, weights)
    full = hosvd.decompose(own_tensor.values)
    report("fitting the fields")
    low, high = controls.min(axis=0), controls.max(axis=0)
    points = (2.0 * controls - low - high) / (high - low)
    proportions, others["offsets"] = _proportions(offsets)
    others |= {"duration": np.log(aligned.durations)[:, None], "warp": aligned.logs}
    fitted = {name: _fit(recipe, points, values) for name, values in others.items()}
    pose = _tuned(recipe, points, full.bases[2] * _spectrum(full))
    reduced = full.truncated(_ranks(recipe, own_tensor, full, len(points) + len(names) + 1))
    solved = kriging.solve(pose.hyper, points, reduced.bases[2])
    missed = np.sum(np.square(pose.residuals), axis=1) / (own_tensor.weight * recipe.motion.frames)
    if recipe.motion.cyclic:
        missed += travel.spread(fitted["travel"].residuals)
    return Trained(
        model=Model(
            FieldBank(low, high, solved, {name: found.field for name, found in fitted.items()}),
            Spread(solved, float(np.mean(missed / pose.variances))),
            Timing(basis, recipe.motion.frames),
            Decoder(reduced, own_tensor.mean, own_tensor.unwhiten, own_chart.means),
            proportions,
            Travel(recipe.motion.frames) if recipe.motion.cyclic else None,
        ),
        skeleton=_mean_skeleton(examples, offsets),
        aligned=aligned,
        tensor=own_tensor,
        full=full,
        pose=pose,
        missed=missed,
        explained={
            "pose": 1.0 - pose.unexplained,
            **{name: found.explained for name, found in fitted.items()},
        },
        findings=findings + noticed,
    )


def _clean(examples: Sequence[Example]) -> tuple[list[Example], list[Finding]]:
    pairs = [without_jumps(example.clip, index) for index, example in enumerate(examples)]
    clean = [replace(e, clip=clip) for e, (clip, _) in zip(examples, pairs, strict=True)]
    return clean, [finding for _, found in pairs for finding in found]


def _joint_weights(recipe: Recipe, examples: Sequence[Example]) -> Floats:
    given = recipe.motion.joint_weights
    return np.array([given.get(name, 1.0) for name in examples[0].clip.skeleton.names])


def _spectrum(full: Multilinear) -> Floats:
    """Singular values (N,) of the sample mode: with them rows of its basis are whole motions."""
    return np.linalg.norm(hosvd.unfold(full.core, 2), axis=1)


def _tuned(recipe: Recipe, points: Floats, values: Floats) -> Tuned:
    settings = recipe.kriging
    guess = tune.first_guess(points, values, settings.covariance, settings.drift)
    return tune.tune(guess, points, values, settings.nugget)


@dataclass(frozen=True)
class _Fitted:
    """A field, the share of the variation that it explains, and residuals (N, m) left out."""

    field: Field
    explained: float
    residuals: Floats


def _fit(recipe: Recipe, points: Floats, values: Floats) -> _Fitted:
    """Field of values (N, m): of the controls, or their mean where those do not explain them."""
    if np.ptp(values, axis=0).max() == 0.0:
        return _Fitted(Constant(values[0]), 0.0, np.zeros_like(values))
    tuned = _tuned(recipe, points, values)
    explained = 1.0 - tuned.unexplained
    # Where the recipe gives a nugget, it has decided that the controls explain the samples.
    if explained <= 0.0 and recipe.kriging.nugget is None:
        from_mean = (values - values.mean(axis=0)) * len(values) / (len(values) - 1)
        return _Fitted(Constant(values.mean(axis=0)), explained, from_mean)
    return _Fitted(kriging.solve(tuned.hyper, points, values), explained, tuned.residuals)


def _ranks(
    recipe: Recipe, own_tensor: MotionTensor, full: Multilinear, weights: int
) -> tuple[int, int, int]:
    size = recipe.size
    if size.ranks is not None:
        return ranks.given(full.core, size.ranks)
    assert size.rms_budget_cm is not None
    frames, samples = own_tensor.values.shape[1:]
    allowed = (0.01 * size.rms_budget_cm) ** 2 * own_tensor.weight * frames * samples
    # One more direction is stored as four numbers a joint and three of the root.
    directions = 4 * len(own_tensor.chart.means) + 3
    return ranks.smallest(full.core, allowed, (directions, frames, weights))


def _proportions(offsets: Floats) -> tuple[Proportions, Floats]:
    """Mean and directions of bone offsets (N, J, 3), and each clip's coefficients (N, r)."""
    mean = offsets.mean(axis=0)
    centred = (offsets - mean).reshape(len(offsets), -1)
    left, values, right = np.linalg.svd(centred, full_matrices=False)
    rank = 1
    while rank < len(values) and _worst(centred, left, values, right, rank) > SAME_BONE:
        rank += 1
    signs = np.sign(right[np.arange(rank), np.argmax(np.round(np.abs(right[:rank]), 9), axis=1)])
    directions = (signs[:, None] * right[:rank]).reshape(rank, -1, 3)
    return Proportions(mean, directions), left[:, :rank] * values[:rank] * signs


def _worst(centred: Floats, left: Floats, values: Floats, right: Floats, rank: int) -> float:
    kept = (left[:, :rank] * values[:rank]) @ right[:rank]
    return float(np.abs(centred - kept).max())


def _mean_skeleton(examples: Sequence[Example], offsets: Floats) -> Skeleton:
    """The family's joints with mean bone offsets, the root at its mean height at rest."""
    first = examples[0].clip.skeleton
    rest = offsets.mean(axis=0)
    rest[0] = np.mean([example.clip.skeleton.offsets[0] for example in examples], axis=0)
    tips = np.mean([example.clip.skeleton.tip_offsets for example in examples], axis=0)
    return Skeleton(first.names, first.parents, rest, first.tip_joints, tips)
