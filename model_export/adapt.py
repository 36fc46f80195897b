"""A trained model and a few clips of somebody new to a model that knows them too.

Nothing of the original data is needed: the model's own samples are motions, which it holds reduced.
The new clips are aligned to what the model expects of somebody never seen, what of them its bases
cannot say extends these, and every field is solved again with the parameters that it has.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from model_export import align, extend, fidelity, flips, kriging, new_fields, phase, threads
from model_export import travel as travels
from model_export.align import FINE, Aligned, Canon
from model_export.chart import Chart
from model_export.decoder import Decoder
from model_export.extend import Extended
from model_export.field_bank import FieldBank
from model_export.flips import Finding
from model_export.ingest import Example
from model_export.model import Model
from model_export.new_fields import Laid
from model_export.recipe import Recipe
from model_export.train import Trained
from service.motion.clip import assemble
from service.motion.conventions import Floats, Indices
from service.motion.skeleton import Skeleton


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


@dataclass(frozen=True)
class Adapted:
    """A model that knows one performer more, and what was seen on the way.

    missed (k,): mean squared joint distance, m², of each new clip from what all others predict.
    """

    model: Model
    moved: Moved
    extended: Extended
    missed: Floats


def adapt(known: Known, examples: Sequence[Example], performer: str) -> Adapted:
    """Model that also knows a performer of some examples, by a name that it does not know yet."""
    with threads.one():
        moved = move(known, examples)
        parents, weights = known.skeleton.parents, known.joint_weights
        extended = extend.extend(known.model, parents, weights, moved.numbers, known.truncation)
        laid = new_fields.lay(known.model.bank, known.groups, moved.examples, performer)
        return _solved(known.model, moved, extended, laid)


def move(known: Known, examples: Sequence[Example]) -> Moved:
    """Examples in the canonical time of a model."""
    references = np.stack([_expected(known, example) for example in examples])
    if known.in_phase:
        weights, in_place = known.joint_weights, known.in_place
        examples = phase.in_phase_with(examples, references, weights, in_place)
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


def _solved(model: Model, moved: Moved, extended: Extended, laid: Laid) -> Adapted:
    reduced = extended.full.truncated(extended.ranks)
    pose = kriging.solve(laid.hyper(model.bank.pose.hyper), laid.samples.points, reduced.bases[2])
    bones, proportions = new_fields.bones(laid, model.bank, model.proportions, moved.offsets)
    durations = np.log(moved.aligned.durations)[:, None]
    new = {**moved.travels, "duration": durations, "warp": moved.aligned.logs}
    solved = {
        name: new_fields.solve(laid, model.bank, name, values) for name, values in new.items()
    }
    # In the order in which the model has them.
    others = {name: solved.get(name, bones) for name in model.bank.others}
    missed, sill = _missed(model.bank, laid, moved, extended)
    bank = FieldBank(laid.low, laid.high, laid.performers, pose, others, sill)
    own = extended.tensor
    decoder = Decoder(reduced, own.mean, own.unwhiten, own.chart.means)
    adapted = Model(bank, model.timing, decoder, proportions, model.travel)
    return Adapted(adapted, moved, extended, missed)


def _missed(old: FieldBank, laid: Laid, moved: Moved, extended: Extended) -> tuple[Floats, float]:
    """Mean squared joint distance (k,), m², of the new clips from what all others predict, and the
    sill, m², with them."""
    hyper, points, k = laid.hyper(old.pose.hyper), laid.samples.points, len(moved.examples)
    left_out = kriging.leave_out(hyper, points, laid.samples.groups)
    variances = kriging.left_out_variances(hyper, points, left_out)[-k:]
    residuals = left_out[-k:] @ extended.full.motions
    frames = extended.tensor.values.shape[1]
    missed = np.sum(np.square(residuals), axis=1) / (extended.tensor.weight * frames)
    for values in moved.travels.values():
        missed += travels.spread(_travel_residuals(old, laid, values))
    n = len(points) - k
    return missed, float((n * old.sill + np.sum(missed / variances)) / (n + k))


def _travel_residuals(old: FieldBank, laid: Laid, new: Floats) -> Floats:
    """Residuals (k, 3) of the new clips' travel, left out."""
    field, both = old.others["travel"], np.vstack([old.at_samples("travel"), new])
    if isinstance(field, kriging.Kriging):
        hyper = laid.hyper(field.hyper)
        return (kriging.leave_out(hyper, laid.samples.points, laid.samples.groups) @ both)[
            -len(new) :
        ]
    return laid.samples.from_mean(both)[-len(new) :]
