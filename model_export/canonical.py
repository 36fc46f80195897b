"""New clips in the canonical time and the chart of a trained model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from model_export import align, bones, fidelity, flips, phase, threads
from model_export import travel as travels
from model_export.align import FINE, Aligned, Canon
from model_export.chart import Chart
from model_export.field_bank import VARIANCE
from model_export.flips import Finding
from model_export.ingest import Example
from model_export.model import Model
from model_export.recipe import Recipe
from model_export.train import Trained
from service.motion.clip import assemble
from service.motion.conventions import Floats, Indices
from service.motion.errors import TrainingError
from service.motion.skeleton import Skeleton

# A clip this many times as far from what the model expects as sigma, which is what it expects of
# somebody never seen, is of another action. On three real families performers who were held out lie
# at most 1.1, 0.9 and 1.8 times as far, clips of another family at least 2.3 times.
STRANGE = 2.0


@dataclass(frozen=True)
class Known:
    """A model of one level, and what of its making it does not hold itself.

    skeleton: the family's. landmarks (M,): their canonical times. joint_weights (J,). in_phase:
    cycles were brought to begin together. in_place: the root does not travel. truncation: what
    cutting the tensor cost, root mean square, m. groups (n,): samples that are left out together.
    """

    model: Model
    skeleton: Skeleton
    landmarks: Floats
    joint_weights: Floats
    in_phase: bool
    in_place: bool
    truncation: float
    groups: Indices

    @property
    def canon(self) -> Canon:
        """Its canonical time."""
        timing = self.model.timing
        return Canon(timing.frames, timing.basis, self.landmarks, self.joint_weights)


def known(recipe: Recipe, trained: Trained) -> Known:
    """What is known of a model that has just been trained."""
    own, marks = trained.model, [example.landmarks for example in trained.examples]
    return Known(
        own,
        trained.skeleton,
        np.array(marks).reshape(len(marks), -1).mean(axis=0),
        fidelity.joint_weights(recipe, trained.examples),
        recipe.motion.cyclic and recipe.alignment.begin == "in_phase",
        recipe.motion.root == "in_place",
        trained.fidelity.rms,
        trained.laid.groups,
    )


@dataclass(frozen=True)
class Moved:
    """New clips in a model's canonical time and chart.

    examples: as they begin there. numbers (k, T, D): pose vectors. offsets (k, J, 3), m. travels:
    (k, 3) of cycles, empty else. distances (k,): of each from what the model expected of somebody
    never seen, root mean square over joints, seen from the root, and frames, m.
    """

    examples: tuple[Example, ...]
    aligned: Aligned
    numbers: Floats
    offsets: Floats
    travels: dict[str, Floats]
    findings: list[Finding]
    distances: Floats


def begin(known: Known, examples: Sequence[Example]) -> tuple[Example, ...]:
    """Examples that begin where a model's cycles do, if those were brought to begin together."""
    if not known.in_phase:
        return tuple(examples)
    with threads.one():
        references = _references(known, examples)
        return phase.in_phase_with(examples, references, known.joint_weights, known.in_place)


def move(known: Known, examples: Sequence[Example]) -> Moved:
    """Examples in the canonical time of a model, where they begin as its own do."""
    with threads.one():
        return _move(known, examples)


def _move(known: Known, examples: Sequence[Example]) -> Moved:
    references = _references(known, examples)
    aligned = align.align_to(examples, references, known.canon)
    distances = _distances(known, examples, aligned.logs, references)
    gone = {}
    if known.model.travel:
        aligned, gone["travel"] = travels.take_out(aligned)
    offsets, own_chart = np.stack([e.offsets for e in examples]), Chart(known.model.decoder.means)
    small = flips.small_joints(known.skeleton.parents, offsets.mean(axis=0))
    rotations, flipped = flips.without_flips_from(own_chart.means, aligned.rotations, small)
    jumps = [replace(jump, clip=i) for i, e in enumerate(examples) for jump in e.jumps]
    findings = jumps + flipped + own_chart.far(rotations)
    numbers = own_chart.numbers(rotations, aligned.root_path)
    return Moved(tuple(examples), aligned, numbers, offsets, gone, findings, distances)


def _references(known: Known, examples: Sequence[Example]) -> Floats:
    return np.stack([_expected(known, example) for example in examples])


def _expected(known: Known, example: Example) -> Floats:
    """Trace (FINE, features) of what the model expects of an example, on the example's bones."""
    model = known.model
    place = np.linspace(0.0, model.timing.frames - 1.0, FINE)[None]
    nobody = np.zeros((1, len(model.bank.performers)))
    answer = model.posed(example.controls[None], place, nobody, 0)
    motion = answer.rotations[0], answer.root_position[0], example.offsets
    clip = assemble(known.skeleton, *motion, (FINE - 1) / example.clip.duration)
    return align.trace(clip, np.sqrt(known.joint_weights))


def _distances(
    known: Known, examples: Sequence[Example], logs: Floats, references: Floats
) -> Floats:
    """Root mean square distances (k,), m, of clips from their references (k, FINE, features)."""
    times, weights = np.linspace(0.0, 1.0, FINE), known.joint_weights
    found = []
    for example, log, reference in zip(examples, logs, references, strict=True):
        trace = align.trace(example.clip, np.sqrt(weights))
        warped = align.at(trace, known.canon.basis.invert(log, times))
        squares = np.sum(np.square(warped - reference), axis=1) / weights.sum()
        found.append(np.sqrt(squares.mean()))
    return np.array(found)


def refuse_strangers(known: Known, moved: Moved) -> None:
    """Raise TrainingError for the first clip of bones of another size, and for the first that lies
    too far from all that the model expects."""
    _refuse_sizes(known.model, moved.examples)
    for example, distance, sigma in zip(
        moved.examples, moved.distances, _sigmas(known.model, moved.examples), strict=True
    ):
        if distance > STRANGE * sigma:
            raise TrainingError(
                f"{example.row.named}: lies {100 * distance:.1f} cm from what the model expects of "
                f"somebody never seen, {distance / sigma:.1f} times the {100 * sigma:.1f} cm by "
                f"which it expects them to differ, expected at most {STRANGE:g} times; is it of "
                "another action, cut elsewhere, or in another unit?"
            )


def _refuse_sizes(model: Model, examples: Sequence[Example]) -> None:
    """What a clip's bones say of its unit, which controls that are measured of it may hide."""
    own = model.proportions.numpy(model.bank.at_samples("offsets"))
    usual = np.median(np.linalg.norm(own, axis=-1).sum(axis=-1))
    for example in examples:
        size = np.linalg.norm(example.offsets, axis=-1).sum() / usual
        if not 1.0 / bones.SIZE <= size <= bones.SIZE:
            raise TrainingError(
                f"{example.row.named}: its bones are {size:.2g} times as long as is usual here, "
                f"expected at most {bones.SIZE:g} times either way; in another unit?"
            )


def _sigmas(model: Model, examples: Sequence[Example]) -> Floats:
    """Sigma (k,) of somebody never seen at the nearest controls that were sampled, m: farther out
    it would excuse anything."""
    bank, asked = model.bank, np.stack([example.controls for example in examples])
    nobody = np.zeros((len(asked), len(bank.performers)))
    points = bank.points(np.clip(asked, bank.low, bank.high), nobody)
    return bank.sigma(bank.numpy(points)[VARIANCE])
