"""A model file to the model in float64 that it was made of, without the data.

The graph holds dual weights, not what the fields were laid through. These are had back from the
dual weights and the system that made them, which hangs on controls, performers and the parameters
of each field: the card has the pose's, the graph scales and labels of all, and `Making` the rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import onnx
from onnx import numpy_helper

from model_export import kriging, samples
from model_export.adapt import Known
from model_export.decoder import Decoder, Proportions
from model_export.field_bank import POSE, Constant, Field, FieldBank
from model_export.hosvd import Multilinear
from model_export.kriging import Hyper, Kriging
from model_export.model import Model
from model_export.timing import Timing
from model_export.travel import Travel
from model_export.warp import WarpBasis
from service.motion import field, quat
from service.motion.card import Making, ModelCard
from service.motion.conventions import Floats, Indices
from service.motion.errors import ModelError
from service.synthesis import session

# Numbers of float32 are this near to those that they were, in half-ranges.
SAME = 1e-5


@dataclass(frozen=True)
class Reopened:
    """What a model file was made of. digest: SHA-256 of its content."""

    known: Known
    card: ModelCard
    making: Making
    digest: str


@dataclass(frozen=True)
class _File:
    """Numbers of a model file by name, with its card; `source` names it in errors."""

    numbers: Mapping[str, Floats]
    card: ModelCard
    making: Making
    source: str

    def __getitem__(self, name: str) -> Floats:
        if name not in self.numbers:
            raise ModelError(self.source, f"has no numbers named {name!r}: it cannot be reopened")
        return self.numbers[name]

    def __contains__(self, name: str) -> bool:
        return name in self.numbers


def reopen(content: bytes, source: str) -> Reopened:
    """Model of one level, and its card, from the bytes of a file; `source` names it in errors.

    Raises ModelError where the service could not open it, and for files older than what this takes.
    """
    own_card = session.open_bytes(content, source).card
    if own_card.making is None or own_card.kriging is None:
        raise ModelError(
            source,
            "was written before models could be adapted: its card does not say what its fields "
            "were solved with; train it again",
        )
    graph = onnx.load_from_string(content).graph
    numbers = {t.name: _plain(numpy_helper.to_array(t)) for t in graph.initializer}
    file = _File(numbers, own_card, own_card.making, source)
    return Reopened(_known(file), own_card, own_card.making, session.sha256(content))


def _plain(array: Any) -> Floats:
    return array if np.issubdtype(array.dtype, np.integer) else array.astype(np.float64)


def _known(file: _File) -> Known:
    card, making = file.card, file.making
    bank = _bank(file)
    model = Model(bank, _timing(file), _decoder(file, bank), _bones(file), _travel(card))
    names = card.skeleton.names
    degree = max(bank.pose.hyper.drifts)
    takes = [source.partition(", frames ")[0] for source in card.sources]
    return Known(
        model,
        card.skeleton,
        np.array(list(making.landmarks.values())),
        np.array([making.joint_weights.get(name, 1.0) for name in names]),
        making.in_phase,
        card.root == "in_place",
        float(card.diagnostics["truncation_rms_m"]),
        samples.by_file(takes, bank.pose.samples[:, : len(card.controls)], degree),
    )


def _travel(card: ModelCard) -> Travel | None:
    return Travel(card.frames) if card.cyclic else None


def _timing(file: _File) -> Timing:
    return Timing(WarpBasis(len(file["warp_still"])), file.card.frames)


def _bones(file: _File) -> Proportions:
    directions = file["offset_directions"]
    mean = file["offset_mean"].reshape(-1, 3)
    return Proportions(mean, directions.reshape(len(directions), -1, 3))


def _bank(file: _File) -> FieldBank:
    """Fields over the samples in the order of the card."""
    card = file.card
    low, high = np.transpose([(c.minimum, c.maximum) for c in card.controls])
    points = field.half_ranges(np.array(card.examples), low, high)
    who = np.array(card.moved_by or [0] * len(points))
    labels = np.eye(max(len(card.performers), 1), len(card.performers))[who]
    points = np.hstack([points, labels])
    order = _order(file, points)
    others = {name: _other(file, name, points, order) for name in _widths(file)}
    assert card.kriging is not None
    pose = _solved(file, POSE, (card.kriging, points, order))
    return FieldBank(low, high, card.performers, pose, others, float(file["sill"]))


def _order(file: _File, points: Floats) -> Indices:
    """Place on the card (n,) of each sample of the graph."""
    d, stored = len(file.card.controls), file["samples"][0].T
    whose = file["whose"] if "whose" in file else np.zeros(len(stored), np.int64)
    own = np.argmax(points[:, d:], axis=1) if "whose" in file else whose
    left = list(range(len(points)))
    order = []
    for sample, label in zip(stored, whose, strict=True):
        gaps = [
            np.abs(points[place, :d] - sample).max() + float(own[place] != label) for place in left
        ]
        best = int(np.argmin(gaps))
        if gaps[best] > SAME:
            raise ModelError(file.source, "its card lists other samples than its graph holds")
        order.append(left.pop(best))
    return np.array(order)


def _widths(file: _File) -> dict[str, int]:
    """How many values each field beside the pose has, in their order."""
    travel = {"travel": 3} if file.card.cyclic else {}
    bones, warp = len(file["offset_directions"]), len(file["warp_still"])
    return {**travel, "offsets": bones, "duration": 1, "warp": warp}


def _columns(file: _File, name: str) -> slice:
    """Where a field stands in the weights of one and the controls, after two of the variance."""
    start = 2
    for other, width in _widths(file).items():
        if other == name:
            return slice(start, start + width)
        start += width
    return slice(start, None)


def _other(file: _File, name: str, points: Floats, order: Indices) -> Field:
    if f"{name}_weights" not in file:
        return Constant(file["drift_weights"][0, _columns(file, name)])
    if name not in file.making.fields:
        raise ModelError(file.source, f"its card does not say what its field {name!r} is made with")
    nugget, *drifts = file.making.fields[name]
    fields = [POSE, *(other for other in _widths(file) if f"{other}_weights" in file)]
    place, own = fields.index(name), file.card.kriging
    assert own is not None
    label = np.sqrt(file["squared_labels"][place].item()) if file.card.performers else 0.0
    scales = np.sqrt(file["squared_scales"][place, :, 0])
    hyper = Hyper(own.covariance, tuple(map(int, drifts)), scales, nugget, label)
    return _solved(file, name, (hyper, points, order))


def _solved(file: _File, name: str, laid: tuple[Hyper, Floats, Indices]) -> Kriging:
    """Field of one name through what its dual weights say that it was laid through."""
    hyper, points, order = laid
    near = np.empty_like(file[f"{name}_weights"])
    near[order] = file[f"{name}_weights"]
    functions = 1 + max(hyper.drifts) * len(hyper.scales)
    dual = np.vstack([near, file["drift_weights"][:functions, _columns(file, name)]])
    return kriging.solve(hyper, points, kriging.values(field.weighing(hyper, points), dual))


def _decoder(file: _File, bank: FieldBank) -> Decoder:
    """Decoder whose first mode's coordinates are those of the core."""
    core = file["core"].transpose(1, 0, 2)
    varying = np.vstack([file["directions"], np.zeros((1, len(core)))])
    unwhiten = varying[file["freedoms"]]
    bases = np.eye(len(core)), file["time_basis"].T, bank.pose.values
    means = file["mean_rotations"][:, :, 0]
    return Decoder(Multilinear(core, bases), _mean(file, means), unwhiten, means)


def _mean(file: _File, means: Floats) -> Floats:
    """Pose vector (D,) that the tensor is centred on: `decoder.turned` the other way round."""
    turned = np.empty_like(means)
    turned[file["joint_order"] if "joint_order" in file else slice(None)] = file[
        "rotation_mean"
    ].reshape(-1, 4)
    vectors = 2.0 * quat.mul(quat.conj(means), turned)[:, 1:]
    return np.concatenate([file["root_mean"], vectors.ravel()])
