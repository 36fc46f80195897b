"""Reconstruction of the float64 model from a model file, without the training data.

The graph holds dual weights, not sample values. These are recovered from the dual weights and the
kriging system, which depends on controls, performers and the parameters of each model. The card
holds the pose's parameters, and `TrainingParameters` those of the other quantities.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from posefield.common.errors import ModelError
from posefield.common.units import Floats, Indices
from posefield.inference import reduced_motion
from posefield.kriging import kriging_model, support
from posefield.kriging.kriging_model import Hyper
from posefield.model_file import checked_file, onnx_file
from posefield.model_file.model_card import ModelCard
from posefield_train.adapt.canonical_clips import AdaptableModel
from posefield_train.align.travel import Travel
from posefield_train.align.warp import CanonicalTiming, WarpBasis
from posefield_train.contacts.contact_model import ContactTable
from posefield_train.graph.float_model import FloatModel
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.kriging_bank import (
    EVENT,
    POSE,
    CoefficientModel,
    ConstantModel,
    KrigingBank,
    PowerLaw,
)
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.tensor.decoder import (
    Decoder,
    EventBlend,
    Proportions,
    build_blend,
    event_weights,
)
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.pose_vectors import PoseChart

# Largest rounding error of sample controls in float32, in half-ranges.
SAMPLE_TOLERANCE = 1e-5


@dataclass(frozen=True)
class ReconstructedModel:
    """A reconstructed model. digest: SHA-256 of the file's content."""

    adaptable: AdaptableModel
    card: ModelCard
    digest: str


@dataclass(frozen=True)
class _ModelFile:
    """Arrays of a model file by name, with its card. source: name of the file in errors."""

    numbers: Mapping[str, Floats]
    card: ModelCard
    source: str

    def __getitem__(self, name: str) -> Floats:
        if name not in self.numbers:
            raise ModelError(self.source, f"has no numbers named {name!r}: it cannot be reopened")
        return self.numbers[name]

    def __contains__(self, name: str) -> bool:
        return name in self.numbers


def load(path: Path) -> ReconstructedModel:
    """Return the model of a file; ModelError if it cannot be read."""
    return reconstruct(checked_file.read(path), str(path))


def reconstruct(content: bytes, source: str) -> ReconstructedModel:
    """Return the model of one level, and its card, from the bytes of a file.

    source: name of the file in errors. Raises ModelError for an invalid checksum, graph or card.
    """
    card = checked_file.load_card(content, source)
    numbers = {name: _as_float64(array) for name, array in onnx_file.initializers(content).items()}
    file = _ModelFile(numbers, card, source)
    return ReconstructedModel(_adaptable(file), card, checked_file.sha256(content))


def _as_float64(array: Any) -> Floats:
    return array if np.issubdtype(array.dtype, np.integer) else array.astype(np.float64)


def _adaptable(file: _ModelFile) -> AdaptableModel:
    card, making = file.card, file.card.making
    bank, basis = _bank(file), WarpBasis(len(file["warp_still"]))
    model = FloatModel(
        bank,
        CanonicalTiming(basis, card.frames, file["warp_still"] - np.log(basis.identity)),
        _decoder(file, bank),
        _proportions(file),
        Travel(card.frames, len(card.skeleton)) if card.cyclic else None,
        ContactTable(file["contact_table"]) if card.contacts else None,
    )
    names = card.skeleton.names
    return AdaptableModel(
        model,
        card.skeleton,
        np.array(list(making.landmarks.values())),
        np.array([making.joint_weights.get(name, 1.0) for name in names]),
        making.in_phase,
        card.root == "in_place",
        float(card.diagnostics["truncation_rms_m"]),
        reduced_motion.leave_out_groups(card, bank.pose.samples),
        np.array(card.left_out),
        card.feet,
        card.contacts,
    )


def _proportions(file: _ModelFile) -> Proportions:
    directions = file["offset_directions"]
    mean = file["offset_mean"].reshape(-1, 3)
    return Proportions(mean, directions.reshape(len(directions), len(mean), 3))


def _bank(file: _ModelFile) -> KrigingBank:
    """Return the coefficient models over the samples in the order of the card."""
    card = file.card
    low, high = card.sampled_ranges
    points = support.half_ranges(np.array(card.examples), low, high)
    points = np.hstack([points, card.clip_labels])
    order = _order(file, points)
    other_models = {name: _coefficient_model(file, name, points, order) for name in _widths(file)}
    pose = _solve_kriging(file, POSE, (card.kriging, points, order))
    sill, law, event = file["sill"].item(), _power_law(file), _event_model(file, pose)
    names = {label_set.name: label_set.names for label_set in card.labels}
    contacts = _contacts(file, (card.kriging, points, order)) if card.contacts else None
    return KrigingBank(low, high, names, pose, other_models, sill, (), law, event, contacts)


def _contacts(file: _ModelFile, samples: tuple[Hyper, Floats, Indices]) -> UniversalKriging:
    """Return the model of the contacts' coefficients, which has the parameters of the pose."""
    weights = file["contact_weights"]
    linear = len(weights) - file.card.samples
    return _solve_recovered(samples, weights[:linear], weights[linear:])


def _event_model(file: _ModelFile, pose: UniversalKriging) -> UniversalKriging | None:
    """Return the model of the pose's leading coefficients around the event, if there is one."""
    count = file.card.levels[0].event
    if not count:
        return None
    return universal_kriging.solve(_hyper(file, EVENT), pose.samples, pose.values[:, :count])


def _hyper(file: _ModelFile, name: str) -> Hyper:
    """Return the parameters of a quantity: the pose's, but for its own of the card."""
    if name not in file.card.making.fields:
        raise ModelError(file.source, f"its card does not say what its field {name!r} is made with")
    nugget, trend, *offsets = file.card.making.fields[name]
    return replace(file.card.kriging.with_offsets(*offsets), nugget=nugget, trend=trend)


def _power_law(file: _ModelFile) -> PowerLaw | None:
    if "duration_exponents" not in file:
        return None
    # In the graph they are widened to whole registers.
    count = len(file.card.controls)
    return PowerLaw(file["duration_exponents"][:count, 0], file["duration_floor"][:count])


def _order(file: _ModelFile, points: Floats) -> Indices:
    """Return the index (n,) on the card of each sample of the graph."""
    order = reduced_motion.importance_order(file.card, file.numbers, points)
    stored = file["samples"].T
    if np.abs(points[order, : len(file.card.controls)] - stored).max() > SAMPLE_TOLERANCE:
        raise ModelError(file.source, "its card lists other samples than its graph holds")
    return order


def _widths(file: _ModelFile) -> dict[str, int]:
    """Return the number of values of each quantity besides the pose, in their order."""
    travel = {"travel": 3} if file.card.cyclic else {}
    bones, warp = len(file["offset_directions"]), len(file["warp_still"])
    return {**travel, "offsets": bones, "duration": 1, "warp": warp}


def _columns(file: _ModelFile, name: str) -> slice:
    """Return the columns of a quantity in the linear weights; the variance takes the first two."""
    start = 2
    for other, width in {**_widths(file), POSE: file.card.levels[0].ranks[2]}.items():
        if other == name:
            return slice(start, start + width)
        start += width
    raise KeyError(name)


def _coefficient_model(
    file: _ModelFile, name: str, points: Floats, order: Indices
) -> CoefficientModel:
    if f"{name}_weights" not in file:
        one = sum(file.card.label_counts)
        return ConstantModel(file["linear_weights"][one, _columns(file, name)])
    return _solve_kriging(file, name, (_hyper(file, name), points, order))


def _solve_kriging(
    file: _ModelFile, name: str, samples: tuple[Hyper, Floats, Indices]
) -> UniversalKriging:
    columns = _columns(file, name)
    stored = file[f"{name}_weights"][:, : columns.stop - columns.start]
    return _solve_recovered(samples, file["linear_weights"][:, columns], stored)


def _solve_recovered(
    samples: tuple[Hyper, Floats, Indices], straight: Floats, stored: Floats
) -> UniversalKriging:
    """Return the kriging model of the values with these weights.

    straight: weights (p + 1 + d, m) of labels, one and controls. stored: weights (n, m) of the
    covariances, in the order of the graph.
    """
    hyper, points, order = samples
    near = np.empty_like(stored)
    near[order] = stored
    covariances = kriging_model.stationary_covariances(hyper, points, points)
    covariances += hyper.nugget * np.eye(len(points))
    linear = kriging_model.linear_functions(hyper, points)
    values = covariances @ near + linear @ straight
    return universal_kriging.solve(hyper, points, values)


def _decoder(file: _ModelFile, bank: KrigingBank) -> Decoder:
    """Return a decoder with the core's coordinates for the first mode."""
    finest = file.card.levels[0]
    stored = reduced_motion.read(file.numbers, replace(finest, event=0), file.card)
    core = stored.core.transpose(1, 0, 2)
    bases = np.eye(len(core)), stored.time, bank.pose.values
    blend = _event_blend(file.card, core, stored.time) if finest.event else None
    tensor, chart = TuckerTensor(core, bases), PoseChart(stored.rotations, stored.chart)
    return Decoder(
        tensor, stored.mean, stored.directions.T, chart, event=blend, curves=stored.curves
    )


def _event_blend(card: ModelCard, core: Floats, basis: Floats) -> EventBlend | None:
    if card.event is None:
        return None
    event = round((card.frames - 1) * card.event.share)
    weights = event_weights(card.frames, event, card.cyclic)
    return build_blend(card.levels[0].event, weights, core, basis)
