"""Tests of every stage of the model: the graph against its float64 reference."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.random import PCG64, Generator
from running import bank_values, outputs

from posefield.kriging.kriging_model import Hyper
from posefield.motion import quat
from posefield.motion.quat import CHARTS
from posefield_train.align.travel import Travel
from posefield_train.align.warp import CanonicalTiming, WarpBasis
from posefield_train.kriging import kriging_bank, universal_kriging
from posefield_train.kriging.kriging_bank import VARIANCE, ConstantModel, KrigingBank
from posefield_train.onnx_graph import LevelTables
from posefield_train.tensor import decoder_graph, hosvd
from posefield_train.tensor.decoder import BLOCK_NUMBERS, Decoder, LevelSize, Proportions
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.pose_vectors import PoseChart

SAMPLES, CONTROLS, BATCH, STEPS = 25, 3, 40, 11
LOW, HIGH = np.array([1.5, -60.0, 0.2]), np.array([1.9, 60.0, 1.8])


def rng():
    return Generator(PCG64(5))


@dataclass(frozen=True)
class Case:
    """A stage's answers both ways, and what float32 may cost them.

    wrong: the reference's answers to a question, or of a stage, that is a little different.
    """

    found: list
    expected: list
    wrong: list
    allowed: float


def bank(covariance="matern52", drifts=(1,), constant=(), offsets=None):
    """Fields pose, offsets, duration and warp; `constant` ones do not depend on the controls.

    offsets: the drifts of the bone offsets' field, where they are others.
    """
    own = rng()
    samples = own.uniform(-1.0, 1.0, (SAMPLES, CONTROLS))
    scales = own.uniform(0.3, 1.5, CONTROLS)
    fields = {}
    for name, size in {"pose": 6, "offsets": 2, "duration": 1, "warp": 4}.items():
        nugget, trend = own.uniform(0.01, 0.3), own.uniform(0.1, 3.0)
        hyper = Hyper(covariance, drifts, scales, nugget, trend)
        if name == "offsets" and offsets is not None:
            hyper = replace(hyper, drifts=offsets)
        values = own.normal(size=(SAMPLES, size))
        solved = universal_kriging.solve(hyper, samples, values)
        fields[name] = ConstantModel(values.mean(axis=0)) if name in constant else solved
    pose = fields.pop("pose")
    return KrigingBank(LOW, HIGH, {}, pose, fields, 0.04)


def asked():
    """Controls inside and outside of what was sampled, and two samples themselves."""
    points = rng().uniform(-1.3, 1.3, (BATCH, CONTROLS))
    points[:2] = bank().pose.samples[:2]
    controls = 0.5 * (points * (HIGH - LOW) + HIGH + LOW)
    # The graph sees float32, and so must the reference.
    return controls.astype(np.float32).astype(np.float64)


def points(own, controls):
    """Return points without labels."""
    return own.points(controls, np.zeros((len(controls), 0)))


def graph_of(own, ranks):
    """Function that builds the fields of a bank, the pose last, and sigma behind it."""

    def build(net, controls):
        return bank_values(net, own, controls, ranks)

    return build


def field_bank(**given):
    own, controls = bank(**given), asked()
    found = outputs(graph_of(own, [6]), (2, 2, 2, 2, 1), controls=controls)
    expected = own.numpy(points(own, controls))
    assert list(expected) == [VARIANCE, "offsets", "duration", "warp", "pose"]
    other = own.numpy(points(replace(own, high=HIGH * 1.05), controls))
    # At a sample the distance is a root of what rounding leaves, where these have their kink.
    kinked = given.get("covariance") in ("exponential", "spherical")
    allowed = 3e-3 if kinked else 2e-4
    return Case(found[:-1], list(expected.values())[1:], list(other.values())[1:], allowed)


LEVELS = ((5, 4), (15, 3), (20, 3), (SAMPLES, 6))


def coarse_bank():
    """A bank of coarser levels that ask some samples, and all of them."""
    own = kriging_bank.sort_samples(bank())
    lesson = kriging_bank.thinning_data(own)
    weights = tuple(lesson.weights(columns, rank, 0.1) for columns, rank in LEVELS)
    return replace(own, coarse=weights)


def level_of_bank(level):
    own, controls = coarse_bank(), asked()
    ranks = [6, *(rank for _, rank in LEVELS)]
    found = outputs(graph_of(own, ranks), (2, 2, 2, 2, 1), level=level, controls=controls)

    def answers(at):
        variance, *values = own.numpy(points(own, controls), at).values()
        return [*values, own.sigma(variance)]

    other = answers(level - 1 or 2)
    other[-2] = np.resize(other[-2], found[-2].shape)
    return Case(found, answers(level), other, 2e-3)


def timing(knots=6):
    own = rng()
    stage = CanonicalTiming(WarpBasis(knots), 60)
    length, logs = own.normal(size=(BATCH, 1)), 0.5 * own.normal(size=(BATCH, knots))
    time = own.uniform(-0.2, 1.3, (BATCH, STEPS)) * np.exp(length)
    time[:, :2] = 0.0, 100.0
    length, logs, time = (a.astype(np.float32).astype(np.float64) for a in (length, logs, time))

    found = outputs(stage.onnx, (2, 2), length=length, logs=logs, time=time)
    found[0] = found[0][:, 0]
    duration, place = stage.numpy(length, logs, time)
    assert place.min() == 0.0
    assert place.max() > 58.999
    wrong = CanonicalTiming(stage.basis, 61).numpy(length + 0.01, logs, time)
    # Frames, of which 0.01 is less than a thousandth of a second; cubes of many knots cancel.
    return Case(found, [duration, place], list(wrong), 2e-4 if knots <= 6 else 1e-2)


def decoder_stage(chart="stereographic"):
    own = rng()
    full = hosvd.decompose(own.normal(size=(12, 20, 15)))
    return Decoder(
        full.truncated((7, 5, 6)),
        own.normal(size=15),
        0.3 * own.normal(size=(15, 12)),
        PoseChart(quat.normalize(own.normal(size=(4, 4))), chart),
    )


def decoded(stage, coefficients, place, level=None):
    """Rotations (B, S, J, 4) and root positions (B, S, 3) of the graph."""
    joints = len(stage.means)

    def build(net, coefficients, place):
        ends = LevelTables(decoder_graph.entries(stage)).onnx(net)
        rows = decoder_graph.onnx(stage, net, coefficients, place, ends)
        return decoder_graph.rows_of_poses(net, rows.planes, joints), rows.root

    rotations, root = outputs(build, (2, 2), level, coefficients=coefficients, place=place)
    return [rotations.reshape(*place.shape, joints, 4), root.reshape(*place.shape, 3)]


def decoder(stage):
    own = rng()
    coefficients = own.normal(size=(BATCH, 6))
    place = own.uniform(0.0, 19.0, (BATCH, STEPS))
    place[:, :4] = 0.0, 19.0, 7.0, 18.5
    coefficients, place = (a.astype(np.float32).astype(float) for a in (coefficients, place))

    found = decoded(stage, coefficients, place)
    nearest = stage.numpy(coefficients, np.rint(place))
    return Case(found, list(stage.numpy(coefficients, place)), list(nearest), 2e-5)


RUNGS = (
    LevelSize((5, 4, 3), (0, 1, 2, 3)),
    LevelSize((5, 3, 3), (0, 1, 3)),
    LevelSize((1, 1, 1), (0,)),
)


def level_of_decoder(level):
    """Coarser levels, of which some keep joints still; a joint in the middle goes first."""
    own = rng()
    stage = replace(decoder_stage(), coarse=RUNGS)
    coefficients = own.normal(size=(BATCH, stage.level_sizes[level].ranks[2]))
    place = own.uniform(0.0, 19.0, (BATCH, STEPS))
    coefficients, place = (a.astype(np.float32).astype(float) for a in (coefficients, place))

    found = decoded(stage, coefficients, place, level)
    moving = replace(stage, coarse=(*RUNGS[:-1], LevelSize((1, 1, 1), (0, 1))))
    other = stage.at_level(level) if level < 3 else moving.at_level(level)
    nearest = other.numpy(coefficients, np.rint(place))
    return Case(found, list(stage.at_level(level).numpy(coefficients, place)), list(nearest), 2e-5)


def poses_at_the_means(chart):
    """No rotation at all: the sine over the angle has its value at zero."""
    stage = decoder_stage(chart)
    still = replace(stage, mean=np.zeros(15))
    nothing = np.zeros((3, 6))

    found = decoded(still, nothing, np.zeros((3, 2)))[:1]
    expected = np.broadcast_to(still.means, (3, 2, 4, 4))
    return Case(found, [expected], [-expected], 1e-6)


def proportions():
    own = rng()
    stage = Proportions(own.normal(size=(5, 3)), own.normal(size=(2, 5, 3)))
    coefficients = own.normal(size=(BATCH, 2)).astype(np.float32).astype(float)
    (rows,) = outputs(stage.onnx, (2,), coefficients=coefficients)
    found = [rows.reshape(BATCH, 5, 3)]
    wrong = stage.numpy(coefficients[:, ::-1])
    return Case(found, [stage.numpy(coefficients)], [wrong], 2e-6)


def travel():
    own, stage = rng(), Travel(20, 5)
    given = {
        "rotations": quat.normalize(own.normal(size=(BATCH, STEPS, 5, 4))),
        "root": own.normal(size=(BATCH, STEPS, 3)),
        "travel": own.normal(size=(BATCH, 3)),
        "frames": own.uniform(0.0, 19.0, (BATCH, STEPS)),
    }
    given = {name: array.astype(np.float32).astype(float) for name, array in given.items()}

    planes, root, gone = outputs(
        stage.onnx,
        (3, 2, 2),
        planes=given["rotations"].reshape(-1, 5, 4).transpose(1, 2, 0),
        root=given["root"].reshape(-1, 3),
        travel=given["travel"],
        frames=given["frames"],
    )
    rotations = planes.transpose(2, 0, 1).reshape(given["rotations"].shape)
    found = [rotations, root.reshape(BATCH, STEPS, 3), gone.reshape(BATCH, STEPS, 3)]
    wrong = stage.numpy(**{**given, "travel": given["travel"] * [1.0, 1.0, -1.0]})
    return Case(found, list(stage.numpy(**given)), list(wrong), 2e-6)


# A decoder whose joints do not turn about some of their axes, as hinges do not.
stiff = decoder_stage()
stiff.unwhiten[[1, 6, 7, 14]] = 0.0
CASES = {
    # All covariances are in test_graph_labels, with sigma.
    **{f"fields, drifts {own}": (field_bank, {"drifts": own}) for own in ((0,), (1,), (0, 1))},
    "fields, exponential": (field_bank, {"covariance": "exponential"}),
    "fields, all but the pose constant": (
        field_bank,
        {"constant": ("offsets", "duration", "warp")},
    ),
    "fields, constant without drift": (field_bank, {"constant": ("warp",), "drifts": (0,)}),
    "fields, less drift of bones": (field_bank, {"drifts": (0, 1), "offsets": (0,)}),
    "fields, more drift of bones": (field_bank, {"drifts": (0,), "offsets": (1,)}),
    **{f"timing, {knots} knots": (timing, {"knots": knots}) for knots in (6, 24)},
    **{f"bank, level {n}": (level_of_bank, {"level": n}) for n in (1, 4)},
    **{f"decoder, level {n}": (level_of_decoder, {"level": n}) for n in (0, 2, 3)},
    "decoder": (decoder, {"stage": decoder_stage()}),
    "decoder of rotation vectors": (decoder, {"stage": decoder_stage("rotation_vector")}),
    "decoder with stiff axes": (decoder, {"stage": stiff}),
    "decoder at the means": (poses_at_the_means, {"chart": "stereographic"}),
    "rotation vectors at the means": (poses_at_the_means, {"chart": "rotation_vector"}),
    "proportions": (proportions, {}),
    "travel of a cycle": (travel, {}),
}


@pytest.mark.parametrize("name", CASES)
def test_graph_answers_what_the_reference_does(name):
    make, given = CASES[name]
    case = make(**given)
    assert len(case.found) == len(case.expected)
    for found, expected in zip(case.found, case.expected, strict=True):
        assert found.shape == expected.shape
        assert np.max(np.abs(found - expected)) < case.allowed
    beside = zip(case.found, case.wrong, strict=True)
    assert max(np.max(np.abs(found - wrong)) for found, wrong in beside) > 3.0 * case.allowed


def test_spread_at_a_sample_is_never_less_than_the_nugget():
    own = bank()
    found = own.sigma(own.numpy(own.pose.samples)[VARIANCE])
    assert np.all(found >= np.sqrt(0.04 * own.pose.hyper.nugget))
    away = own.sigma(own.numpy(np.full((1, CONTROLS), 5.0))[VARIANCE])
    assert away > 2.0 * found.max()


def test_poses_at_whole_frames_are_those_of_the_tensor():
    stage = decoder_stage()
    coefficients = stage.reduced.bases[2]
    frames = np.tile(np.arange(20.0), (15, 1))
    found = stage.numpy(coefficients, frames)
    numbers = stage.mean + stage.reduced.restored().transpose(2, 1, 0) @ stage.unwhiten.T
    turns = CHARTS["stereographic"].quaternions(numbers[..., 3:].reshape(15, 20, 4, 3))
    rotations = quat.mul(stage.means, turns)
    assert np.max(np.abs(quat.to_matrix(found[0]) - quat.to_matrix(rotations))) < 1e-12
    assert np.max(np.abs(found[1] - numbers[..., :3])) < 1e-12
    full = TuckerTensor(stage.reduced.core[::-1], stage.reduced.bases)
    other = replace(stage, reduced=full).numpy(coefficients, frames)
    assert np.max(np.abs(other[1] - numbers[..., :3])) > 1e-2


def test_poses_at_one_frame_are_those_at_that_frame():
    stage, coefficients = decoder_stage(), rng().normal(size=(5, 6))
    joints = (0, 1, 3)
    for decoder in (stage, stage.select_joints(joints)):
        rotations, root = stage.numpy(coefficients, np.full((5, 1), 7.0))
        found = decoder.at_frame(coefficients, 7)
        kept = range(4) if decoder is stage else joints
        assert np.max(np.abs(found[0] - rotations[:, 0, list(kept)])) < 1e-12
        assert np.max(np.abs(found[1] - root[:, 0])) < 1e-12
        other = decoder.at_frame(coefficients, 8)
        assert np.max(np.abs(other[0] - found[0])) > 1e-3


def test_poses_in_several_batches_are_those_of_a_few():
    stage, coefficients = decoder_stage(), rng().normal(size=(5, 6))
    few = stage.numpy(coefficients, np.full((5, 1), 7.3))
    r1, r2, _ = stage.reduced.core.shape
    many = 1 + BLOCK_NUMBERS // (r1 * r2)
    both = stage.numpy(np.resize(coefficients, (many, 6)), np.full((many, 1), 7.3))
    last = (many - 1) % 5
    for one, all_ in zip(few, both, strict=True):
        assert np.array_equal(all_[:5], one)
        assert np.max(np.abs(all_[-1] - one[last])) < 1e-12
        assert np.max(np.abs(all_[-1] - one[last - 1])) > 1e-3
