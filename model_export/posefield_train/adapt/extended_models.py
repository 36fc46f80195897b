"""Coefficient models of a trained model, solved again with new samples and unchanged parameters.

Only the half-ranges change: if a sampled range grows, the scales grow with it, so that all
distances between points stay the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import half_ranges
from posefield.model_file.model_card import PERFORMER
from posefield_train.kriging import coefficient_models, sample_points, universal_kriging
from posefield_train.kriging.coefficient_models import SAME_BONE
from posefield_train.kriging.kriging_bank import CoefficientModel, ConstantModel, KrigingBank
from posefield_train.kriging.sample_points import LabelNames, SamplePoints
from posefield_train.kriging.universal_kriging import Hyper
from posefield_train.source.ingest import Example
from posefield_train.tensor.decoder import Proportions


@dataclass(frozen=True)
class ExtendedSamples:
    """Samples of a model followed by new ones.

    low, high: ends of the sampled ranges (d,). labels: names of each label set. growth: ratio (d,)
    of new to old ranges.
    """

    low: Floats
    high: Floats
    labels: LabelNames
    samples: SamplePoints
    growth: Floats

    def hyper(self, old: Hyper) -> Hyper:
        """Return parameters rescaled to the new ranges, with the new number of names."""
        # One trend serves all controls, so that the most extended one decides.
        trend = old.trend * float(np.max(self.growth)) ** 2
        pairs = zip(old.labels, self.samples.labels, strict=True)
        labels = tuple(replace(kernel, count=count) for kernel, count in pairs)
        return replace(old, scales=old.scales * self.growth, trend=trend, labels=labels)


def extend_samples(
    bank: KrigingBank, old_groups: Indices, examples: Sequence[Example], performer: str
) -> ExtendedSamples:
    """Return the samples of a bank, with groups (n,), followed by examples of a new performer.

    New examples are grouped by take for leave-one-out. Their other labels are those of their rows.
    """
    d = len(bank.low)
    old = (bank.pose.samples[:, :d] * (bank.high - bank.low) + bank.low + bank.high) / 2.0
    new = np.stack([example.controls for example in examples])
    low, high = np.minimum(bank.low, new.min(axis=0)), np.maximum(bank.high, new.max(axis=0))
    added = [{**example.row.labels, PERFORMER: performer} for example in examples]
    given = [*_labels(bank), *added]
    names = {name: tuple(sorted({labels[name] for labels in given})) for name in bank.labels}
    weights = sample_points.label_weights(given, names)
    points = np.hstack([half_ranges(np.vstack([old, new]), low, high), weights])
    groups = np.concatenate(
        [old_groups, 1 + old_groups.max() + sample_points.take_numbers(examples)]
    )
    growth = (high - low) / (bank.high - bank.low)
    samples = SamplePoints(points, d, groups, tuple(map(len, names.values())))
    return ExtendedSamples(low, high, names, samples, growth)


def _labels(bank: KrigingBank) -> list[dict[str, str]]:
    """Return the name of each sample of a bank in each label set."""
    counts = tuple(map(len, bank.labels.values()))
    columns = kriging_model.label_columns(len(bank.low), counts)
    return [
        {
            name: names[int(np.argmax(point[own]))]
            for (name, names), own in zip(bank.labels.items(), columns, strict=True)
        }
        for point in bank.pose.samples
    ]


def solve_extended(
    laid: ExtendedSamples, bank: KrigingBank, name: str, new: Floats
) -> CoefficientModel:
    """Return one of a bank's other models solved with its old values and new ones (k, m)."""
    field, old = bank.others[name], bank.sample_values(name)
    if isinstance(field, ConstantModel):
        # The controls did not explain the old values, so the model stays constant.
        n, k = len(old), len(new)
        return ConstantModel((n * field.mean + new.sum(axis=0)) / (n + k))
    hyper = laid.hyper(field.hyper)
    return universal_kriging.solve(hyper, laid.samples.points, np.vstack([old, new]))


def solve_bones(
    laid: ExtendedSamples, bank: KrigingBank, proportions: Proportions, offsets: Floats
) -> tuple[CoefficientModel, Proportions]:
    """Return the model of bone offsets solved with new clips' (k, J, 3), m, and its directions."""
    known = bank.sample_values("offsets")
    old, new, longer = _extend_proportions(proportions, known, offsets)
    both, field = np.vstack([old, new]), bank.others["offsets"]
    if not isinstance(field, ConstantModel):
        return universal_kriging.solve(laid.hyper(field.hyper), laid.samples.points, both), longer
    apart = longer.numpy(new) - longer.numpy(old[:1])
    if np.abs(apart).max() <= SAME_BONE:
        return ConstantModel(old[0]), longer
    return universal_kriging.solve(
        _performer_parameters(laid, bank), laid.samples.points, both
    ), longer


# Bounds of the search for parameters: bones hardly vary between the clips of a performer.
SMALLEST_NUGGET, LARGEST_OFFSET = 1e-3, 30.0


def _performer_parameters(laid: ExtendedSamples, bank: KrigingBank) -> Hyper:
    """Return parameters of a model that is nearly constant for each performer.

    The offset outweighs what remains of the stationary covariance.
    """
    shared = laid.hyper(bank.pose.hyper).with_offsets(
        *(LARGEST_OFFSET if name == PERFORMER else 0.0 for name in bank.labels)
    )
    return replace(shared, nugget=SMALLEST_NUGGET, trend=0.0)


def _extend_proportions(
    proportions: Proportions, known: Floats, offsets: Floats
) -> tuple[Floats, Floats, Proportions]:
    """Return coefficients of old (n, r) and new clips, with directions extended for the new."""
    flat = proportions.directions.reshape(len(proportions.directions), -1)
    centred = (offsets - proportions.mean).reshape(len(offsets), -1)
    own = centred @ np.linalg.pinv(flat)
    left, values, right = np.linalg.svd(centred - own @ flat, full_matrices=False)
    rank = 0
    while rank < len(values) and _largest_residual(left, values, right, rank) > SAME_BONE:
        rank += 1
    more = right[:rank] * coefficient_models.row_signs(right[:rank])[:, None]
    directions = np.vstack([flat, more]).reshape(-1, *proportions.mean.shape)
    directions[:, 0] = 0.0
    beyond = left[:, :rank] * values[:rank] * coefficient_models.row_signs(right[:rank])
    return (
        np.pad(known, ((0, 0), (0, rank))),
        np.hstack([own, beyond]),
        Proportions(proportions.mean, directions),
    )


def _largest_residual(left: Floats, values: Floats, right: Floats, rank: int) -> float:
    """Return the largest absolute entry of the remainder of a truncated decomposition."""
    return float(np.abs((left[:, rank:] * values[rank:]) @ right[rank:]).max())
