"""Predictions of every method for the same queries, from the same training."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from paper import naive_kriging, variogram

from evaluation import linear_smoothers, peers
from evaluation.linear_smoothers import LinearSmoother
from evaluation.peers import LINEAR_PEERS, Interpolator
from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield.kriging import kriging_model
from posefield_train.evaluate import predictions
from posefield_train.evaluate.predictions import GP, OURS, Predictions, Queries, Values
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import truncation_error

OPEN = "_no_performer"
"""End of the name of a method that is not told the performer, where others are."""
EXACT, NAIVE, SAME_PERFORMER = "posefield_exact", "naive", "nearest_same_performer"
UNCORRECTED = OURS + "_uncorrected"
NO_PERFORMER, ASKED_OPEN = OURS + OPEN, "posefield_open"
"""Posefield trained without performers, and trained with them but asked without one."""
ADAPTATION_COUNTS = {"posefield_adapt_1": 1, "posefield_adapt_3": 3, "posefield_adapt_5": 5}
"""Number of clips that each method adapts with."""
OFFSETS_OF = "thin_plate_smoothed"
"""Peer whose offsets of performers the paper's per-frame kriging gets."""
DEFINITIONS = {
    **predictions.DEFINITIONS,
    EXACT: "the same, with the event's joint moved by the service's constraint solver to its "
    "captured position at the event",
    UNCORRECTED: "the same without the correction that makes predicted time functions the "
    "identity in the mean",
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
    SAME_PERFORMER: "scikit-learn, nearest of the same performer",
    **{name: words for name, (_, words) in LINEAR_PEERS.items()},
}
"""Definition of each method.

Where performers have labels, every method is told the performer: as columns (gp), by the choice of
examples (nearest_same_performer), or as an offset of each performer, estimated from left-out takes
and shrunk as far as they advise (all others; naive has the offsets of thin_plate_smoothed). The
same methods with controls alone end in OPEN.
"""


def definition(name: str) -> str:
    """Return the definition of a method."""
    if name in DEFINITIONS:
        return DEFINITIONS[name]
    return f"{name.removesuffix(OPEN)} without the performer"


def predict(recipe: Recipe, trained: TrainedModel, queries: Queries) -> Predictions:
    """Return the predictions of every method, posefield's first."""
    points = predictions.query_points(trained, queries)
    samples = _groups_for_lines(trained.samples)
    values, offsets = peer_values(samples, trained.values, points)
    naive = _naive(trained, samples, points, offsets if samples.labels else {})
    listed = {
        name: predictions.with_pose_vectors(trained, vectors) for name, vectors in values.items()
    }
    return predictions.with_sigma(trained, queries, naive | listed)


def check_lines(examples: list[Example], names: tuple[str, ...]) -> None:
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


def _groups_for_lines(samples: SamplePoints) -> SamplePoints:
    """Return samples of which a line can be fitted without any group; single ones if need be."""
    functions = kriging_model.drift(samples.half_ranges, samples.controls, 1)
    if kriging_model.find_required_group(samples.groups, functions) is None:
        return samples
    return replace(samples, groups=np.arange(len(samples.points)))


def peer_values(
    samples: SamplePoints, values: Values, points: Floats
) -> tuple[dict[str, Values], Values]:
    """Return the values that each peer predicts at points (q, d + p), and offsets of performers.

    Where performers have labels, each peer is there twice: told the performer, and with OPEN at the
    end of its name with controls alone. Offsets (p, m) of each quantity are those of OFFSETS_OF.
    """
    predicted: dict[str, Values] = {}
    offsets: Values = {}
    for name, (settings, _) in LINEAR_PEERS.items():
        choices = [linear_smoothers.smoother(peer, samples, points) for peer in settings]
        predicted |= _linear(name, choices, samples, values, points)
        if name == OFFSETS_OF:
            offsets = {
                key: linear_smoothers.chosen_offsets(choices, samples, sample_values)
                for key, sample_values in values.items()
            }
    predicted[GP] = _by_quantity(predictions.predict_process, samples, values, points)
    if samples.labels:
        predicted[GP + OPEN] = _by_quantity(gp_without_performers, samples, values, points)
        predicted[SAME_PERFORMER] = _by_quantity(
            peers.nearest_of_performer, samples, values, points
        )
    return predicted, offsets


def gp_without_performers(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
    """Return the predictions of the Gaussian process from the controls alone."""
    alone = SamplePoints(samples.half_ranges, samples.controls, samples.groups)
    return predictions.predict_process(alone, values, queries[:, : samples.controls])


def _by_quantity(
    peer: Interpolator, samples: SamplePoints, values: Values, points: Floats
) -> Values:
    return {key: peer(samples, sample_values, points) for key, sample_values in values.items()}


def _linear(
    name: str,
    choices: list[LinearSmoother],
    samples: SamplePoints,
    values: Values,
    points: Floats,
) -> dict[str, Values]:
    alone = {
        key: linear_smoothers.predict(choices, sample_values)
        for key, sample_values in values.items()
    }
    if not samples.labels:
        return {name: alone}
    with_performer = {
        key: linear_smoothers.predict_with_performers(choices, samples, sample_values, points)
        for key, sample_values in values.items()
    }
    return {name: with_performer, name + OPEN: alone}


def _naive(
    trained: TrainedModel, samples: SamplePoints, points: Floats, offsets: Values
) -> dict[str, Values]:
    """Krige each frame on its own, and the other quantities in the same way as one frame.

    offsets: of performers (p, m) by quantity, taken from the samples and added to the prediction;
    empty for a family without labels.
    """
    tensor, parents = trained.tensor, trained.skeleton.parents
    bones = np.stack([example.offsets for example in trained.examples])
    positions = truncation_error.positions(tensor, tensor.values, parents, bones)
    controls = samples.controls
    # Variograms are of the captured motions, whose performers differ.
    shown = {name: values[:, None, :, None] for name, values in trained.values.items()}
    shown["pose"] = positions

    def krige(values: Values) -> Values:
        predicted = {}
        for name, offset_values in values.items():
            frames = offset_values if name == "pose" else offset_values[:, None]
            model = naive_kriging.fit_naive(
                samples.half_ranges, shown[name], frames, "matern52", variogram.fit_by_grid
            )
            rows = model.numpy(points[:, :controls])
            predicted[name] = rows if name == "pose" else rows[:, 0]
        return predicted

    alone = {**trained.values, "pose": tensor.numbers(tensor.values)}
    if not offsets:
        return {NAIVE: krige(alone)}
    offset_values = _offset_values(trained, offsets, samples.points[:, controls:])
    rest = krige({name: values - offset_values[name] for name, values in alone.items()})
    queried = _offset_values(trained, offsets, points[:, controls:])
    return {
        NAIVE: {name: values + queried[name] for name, values in rest.items()},
        NAIVE + OPEN: krige(alone),
    }


def _offset_values(trained: TrainedModel, offsets: Values, labels: Floats) -> Mapping[str, Floats]:
    """Return the offsets of labelled performers (Q, p), with pose vectors."""
    values = {name: labels @ offset for name, offset in offsets.items()}
    pose = values["pose"]
    vectors = predictions.pose_vectors(trained, pose)
    return {**values, "pose": vectors - predictions.pose_vectors(trained, np.zeros_like(pose))}
