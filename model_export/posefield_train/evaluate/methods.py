"""Predictions of every method for the same queries, from the same training."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield.kriging import kriging_model
from posefield.motion import skeleton
from posefield_train.evaluate import compared_motion
from posefield_train.evaluate.compared_motion import ComparedMotion, MotionEvent
from posefield_train.evaluate.peers import predicted_values
from posefield_train.evaluate.peers.predicted_values import OPEN
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import naive_kriging, sample_points, universal_kriging, variogram
from posefield_train.kriging.kriging_bank import VARIANCE
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import truncation_error, uniform_motion
from posefield_train.tensor.uniform_motion import UNIFORM_SHARES

OURS, EXACT, NAIVE = "posefield", "posefield_exact", "naive"
NO_PERFORMER, ASKED_OPEN = OURS + OPEN, "posefield_open"
"""Posefield trained without performers, and trained with them but asked without one."""
DEFINITIONS = {
    OURS: "the model as exported: truncated, with its own bone lengths and timing",
    EXACT: "the same, with the event's joint moved by the service's constraint solver to its "
    "captured position at the event",
    NO_PERFORMER: "a model of the same recipe, trained without performers",
    ASKED_OPEN: "the model trained with performers, asked with the performer left open: it "
    "then answers for a person whom it has not seen",
    **{
        f"posefield_adapt_{count}": f"the same model adapted to the performer with {shown} from "
        "different takes, far apart in the controls and not from the take of the predicted clip; "
        "only for clips whose performer has at least three other takes"
        for count, shown in ((1, "one clip"), (3, "three clips"), (5, "up to five clips"))
    },
    NAIVE: "kriging of each frame on its own, isotropic, variogram fitted by weighted least "
    "squares (Mukai & Kuriyama 2005); posefield's own code, checked against GSTools",
    **predicted_values.DEFINITIONS,
}
"""Definition of each method."""
TOLD = (
    "Where performers have labels, every method is told the performer: as columns (gp), by the "
    "choice of examples (nearest_same_performer), or as an offset of each performer, estimated "
    "from left-out takes and shrunk as far as they advise (all others; naive has the offsets of "
    "thin_plate_smoothed). The same methods with controls alone end in _no_performer."
)
"""Sentence for readers of the results on how each method is given the performer."""


def definition(name: str) -> str:
    """Return the definition of a method."""
    if name in DEFINITIONS:
        return DEFINITIONS[name]
    return f"{name.removesuffix(OPEN)} without the performer"


@dataclass(frozen=True)
class Queries:
    """Queries. controls: (Q, d). labels: names of each query by label set; empty for none."""

    controls: Floats
    labels: Sequence[Mapping[str, str]]


@dataclass(frozen=True)
class Predictions:
    """Predictions of all methods.

    motions: by method; None for queries that a method does not predict. sigma: standard deviation
    (Q,) that posefield predicts, m. joint_sigma: of each joint (Q, J), m.
    """

    motions: Mapping[str, Sequence[ComparedMotion | None]]
    sigma: Floats
    joint_sigma: Floats


@dataclass(frozen=True)
class _PredictedValues:
    """Predicted values.

    numbers: pose vectors (Q, T, D) on canonical time. beside: the other quantities by name.
    """

    numbers: Floats
    beside: dict[str, Floats]

    def __add__(self, other: "_PredictedValues") -> "_PredictedValues":
        rest = {key: own + other.beside[key] for key, own in self.beside.items()}
        return _PredictedValues(self.numbers + other.numbers, rest)

    def __sub__(self, other: "_PredictedValues") -> "_PredictedValues":
        rest = {key: own - other.beside[key] for key, own in self.beside.items()}
        return _PredictedValues(self.numbers - other.numbers, rest)


def predict_all(recipe: Recipe, trained: TrainedModel, asked: Queries) -> Predictions:
    """Return the answers of every method, posefield's first."""
    event = truncation_error.event_frame(recipe, trained.examples)
    bank = trained.model.bank
    points = bank.points(asked.controls, _labels(trained, asked))
    peers = _peer_values(trained, points)
    together = _PredictedValues(
        np.concatenate([own.numbers for own in peers.values()]),
        {
            key: np.concatenate([own.beside[key] for own in peers.values()])
            for key in next(iter(peers.values())).beside
        },
    )
    listed = _motions_of_values(trained, together, event)
    motions: dict[str, list[ComparedMotion]] = {OURS: predict_posefield(recipe, trained, asked)}
    for place, name in enumerate(peers):
        motions[name] = listed[place * len(points) : (place + 1) * len(points)]
    sigma = bank.sigma(bank.numpy(points)[VARIANCE])
    return Predictions(motions, sigma, sigma[:, None] * trained.joints)


def captured_event(
    recipe: Recipe, trained: TrainedModel, landmarks: Sequence[float]
) -> MotionEvent | None:
    """Return the event of a captured clip from its landmarks; None if the recipe names none."""
    found = truncation_error.event_frame(recipe, trained.examples)
    if found is None or recipe.event is None:
        return None
    if recipe.event.at in ("start", "end"):
        return MotionEvent(found.joint, float(recipe.event.at == "end"))
    return MotionEvent(found.joint, landmarks[recipe.landmark_names.index(recipe.event.at)])


def _labels(trained: TrainedModel, asked: Queries) -> Floats:
    return sample_points.label_weights(asked.labels, trained.model.bank.labels)


def predict_posefield(
    recipe: Recipe, trained: TrainedModel, asked: Queries
) -> list[ComparedMotion]:
    """Return the answers of the exported model."""
    event = truncation_error.event_frame(recipe, trained.examples)
    labels, model = _labels(trained, asked), trained.model
    fields = model.bank.numpy(model.bank.points(asked.controls, labels))
    times = np.exp(fields["duration"]) * UNIFORM_SHARES
    found = model.evaluate(asked.controls, times, labels)
    places = found.rotations, found.root_position, found.bone_offsets
    motions = _motions(trained, *places, found.duration, fields["warp"], event)
    if found.curves is None:
        return motions
    return compared_motion.with_curves(motions, model.decoder.curves, found.curves)


def _motions(
    trained: TrainedModel,
    rotations: Floats,
    path: Floats,
    offsets: Floats,
    durations: Floats,
    logs: Floats,
    event: truncation_error.EventFrame | None,
) -> list[ComparedMotion]:
    """Return motions of rotations (Q, S, J, 4), root paths (Q, S, 3), bone offsets (Q, J, 3)."""
    translations = skeleton.translations(offsets, path)
    events = [_synthesised_event(trained, log, event) for log in logs]
    return compared_motion.motions_of_poses(
        trained.skeleton.parents, rotations, translations, list(map(float, durations)), events
    )


def _synthesised_event(
    trained: TrainedModel, logs: Floats, event: truncation_error.EventFrame | None
) -> MotionEvent | None:
    """Return the event at the share of the duration that the predicted timing gives it."""
    if event is None:
        return None
    timing = trained.model.timing
    place = np.array([event.frame / (timing.frames - 1)])
    return MotionEvent(event.joint, float(timing.basis.invert(logs, place)[0]))


def _peer_values(trained: TrainedModel, points: Floats) -> dict[str, _PredictedValues]:
    """Return the values that each peer predicts at points (Q, d + p)."""
    laid = _groups_for_lines(trained.samples)
    found = predicted_values.predict(laid, trained.values, points)
    peers = _predict_naive(trained, laid, points, found.offsets if laid.labels else {})
    for name, values in found.values.items():
        rest = {key: own for key, own in values.items() if key != "pose"}
        peers[name] = _PredictedValues(_pose_vectors(trained, values["pose"]), rest)
    return peers


def _groups_for_lines(laid: SamplePoints) -> SamplePoints:
    """Return samples of which a line can be fitted without any group; single ones if need be."""
    functions = kriging_model.drift(laid.half_ranges, laid.controls, 1)
    if kriging_model.find_required_group(laid.groups, functions) is None:
        return laid
    return replace(laid, groups=np.arange(len(laid.points)))


def check_lines(examples: Sequence[Example], names: tuple[str, ...]) -> None:
    """Raise TrainingError if the peers, which fit lines, could not leave out each example.

    names: of the controls.
    """
    controls = np.stack([example.controls for example in examples])
    universal_kriging.check_samples(controls, names, 1, nugget_is_zero=False)
    functions = kriging_model.drift(controls, len(names), 1)
    needed = kriging_model.find_required_group(np.arange(len(controls)), functions)
    if needed is not None:
        raise TrainingError(
            f"without the clip of line {examples[needed].row.line} the controls of all others "
            "follow linearly from one another; expected at least two clips that differ there, "
            "since methods that fit a line are compared"
        )


def _pose_vectors(trained: TrainedModel, coefficients: Floats) -> Floats:
    """Return pose vectors (Q, T, D) of motions (Q, N) in coordinates of the sample mode."""
    return trained.tensor.numbers(trained.full.slices(coefficients))


def _predict_naive(
    trained: TrainedModel, laid: SamplePoints, points: Floats, offsets: Mapping[str, Floats]
) -> dict[str, _PredictedValues]:
    """Krige each frame on its own, and the other quantities in the same way as one frame.

    offsets: of performers (p, m) by quantity, taken from the samples and added to the prediction;
    empty for a family without labels.
    """
    whole, parents = trained.tensor, trained.skeleton.parents
    bones = np.stack([example.offsets for example in trained.examples])
    positions = truncation_error.positions(whole, whole.values, parents, bones)
    known, asked = laid.half_ranges, points[:, : laid.controls]
    rest = {name: values for name, values in trained.values.items() if name != "pose"}

    def krige(samples: _PredictedValues) -> _PredictedValues:
        def predict(shown: Floats, values: Floats) -> Floats:
            fitted = naive_kriging.fit_naive(
                known, shown, values, "matern52", variogram.fit_by_grid
            )
            return fitted.numpy(asked)

        beside = {
            n: predict(rest[n][:, None, :, None], own[:, None])[:, 0]
            for n, own in samples.beside.items()
        }
        return _PredictedValues(predict(positions, samples.numbers), beside)

    alone = _PredictedValues(whole.numbers(whole.values), rest)
    if not offsets:
        return {NAIVE: krige(alone)}
    own = _offset_values(trained, offsets, laid.points[:, laid.controls :])
    return {
        NAIVE: krige(alone - own) + _offset_values(trained, offsets, points[:, laid.controls :]),
        NAIVE + OPEN: krige(alone),
    }


def _offset_values(
    trained: TrainedModel, offsets: Mapping[str, Floats], labels: Floats
) -> _PredictedValues:
    """Return the offsets of labelled performers (Q, p)."""
    found = {key: labels @ own for key, own in offsets.items()}
    pose = found.pop("pose")
    return _PredictedValues(
        _pose_vectors(trained, pose) - _pose_vectors(trained, np.zeros_like(pose)), found
    )


def _motions_of_values(
    trained: TrainedModel, values: _PredictedValues, event: truncation_error.EventFrame | None
) -> list[ComparedMotion]:
    """Return motions of predicted values, with the model's timing, travel, chart and bones."""
    beside, model = values.beside, trained.model
    poses = uniform_motion.predicted_poses(
        model.timing, trained.tensor, values.numbers, beside["warp"], beside.get("travel")
    )
    offsets = model.proportions.numpy(beside["offsets"])
    durations = np.exp(beside["duration"][:, 0])
    motions = _motions(
        trained, poses.rotations, poses.path, offsets, durations, beside["warp"], event
    )
    return compared_motion.with_curves(motions, trained.tensor.curves, poses.curves)
