"""Tests of takes: conditional simulations of a motion, as clips and as poses."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.constraints.take_variation import TakeSettings, TakeVariation
from posefield.inference import reduced_motion, session
from posefield.performance import act_motion, passage
from posefield.question.motion_question import ClipQuestion, PoseQuestion, Target
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import NO_DETAIL, Synthesizer

SEED = 7


@pytest.fixture(scope="module")
def reach(labelled_path) -> Synthesizer:
    """A model of reaches with performers."""
    return Synthesizer("reach", session.load(labelled_path))


@pytest.fixture(scope="module")
def walk(walk_path) -> Synthesizer:
    """A model of a walk."""
    return Synthesizer("walk", session.load(walk_path))


@pytest.fixture(params=["reach", "walk"])
def model(request) -> Synthesizer:
    return request.getfixturevalue(request.param)


def middle(model, **changed):
    return {c.name: c.default for c in model.session.card.controls} | changed


def clip(model, controls=None, **asked):
    """Joint positions (F, J, 3) of a clip, and its trust."""
    answer = clips.synthesize_clip(
        model, ClipQuestion(controls=controls or middle(model), **{"exact": "none"} | asked)
    )
    return answer.clip.positions(), answer.trust


def apart(a, b):
    """Root mean square distance of two motions' joints in the frames that both have, m."""
    count = min(len(a), len(b))
    return float(np.sqrt(np.mean(np.sum(np.square(a[:count] - b[:count]), axis=-1))))


def test_takes_differ_and_are_the_mean_without_seed_or_variety(model):
    mean, trust = clip(model)
    assert np.array_equal(clip(model, take=0, variety=1.0)[0], mean)
    assert apart(clip(model, take=SEED, variety=0.0)[0], mean) < 1e-6
    first, own = clip(model, take=SEED)
    other, _ = clip(model, take=SEED + 1)
    assert apart(first, mean) > 1e-3 and apart(first, other) > 1e-3
    assert own.sigma == trust.sigma and own.controls == trust.controls


def test_takes_vary_as_much_as_sigma_says(model):
    """The mean square over seeds is sigma's, but for the part that is not varied."""
    mean, trust = clip(model)
    squares = [apart(clip(model, take=seed, variety=1.0)[0], mean) ** 2 for seed in range(1, 41)]
    assert 0.3 < np.sqrt(np.mean(squares)) / trust.sigma < 2.5
    halved = [apart(clip(model, take=seed, variety=0.5)[0], mean) ** 2 for seed in range(1, 41)]
    assert np.sqrt(np.mean(halved) / np.mean(squares)) == pytest.approx(0.5, abs=0.05)


def test_a_captured_clip_is_its_own_only_take_without_nugget(model):
    card = model.session.card
    exact = replace(card, kriging=replace(card.kriging, nugget=0.0))
    row = np.array(card.examples[:1]), card.clip_labels[:1]
    found = TakeVariation(replace(model.session, card=exact)).deviations(*row, np.array([SEED]))
    noisy = TakeVariation(model.session).deviations(*row, np.array([SEED]))
    # Without nugget the system is badly conditioned.
    assert np.abs(found).max() < 1e-3 * np.abs(noisy).max()


def test_a_take_is_a_smooth_function_of_the_controls(model):
    control = model.session.card.controls[0]
    values = np.linspace(control.minimum, control.maximum, 41)
    points = np.array([[*middle(model, **{control.name: value}).values()] for value in values])
    nobody = np.zeros((1, sum(model.session.card.label_counts)))
    sampler = TakeVariation(model.session)

    def largest_step(seeds):
        pairs = zip(points, seeds, strict=True)
        path = np.array(
            [sampler.deviations(own[None], nobody, np.array([seed]))[0] for own, seed in pairs]
        )
        return np.abs(np.diff(path, axis=0)).max() / np.ptp(path, axis=0).max()

    assert largest_step([SEED] * 41) < 0.15
    assert largest_step(range(1, 42)) > 0.5


def test_a_pose_of_a_take_is_the_frame_of_its_clip(model):
    asked = {"controls": middle(model), "take": SEED, "detail": True}
    end = poses.synthesize_poses(model, PoseQuestion(**asked, times=[0.0])).trust.duration
    # The last frame is the end, so that none is moved.
    answer = clips.synthesize_clip(
        model, ClipQuestion(**asked, fps=20.0 / end, feet="as_predicted")
    )
    pose = poses.synthesize_poses(model, PoseQuestion(**asked, times=[0.2 * end]))
    # Products of matrices of other sizes round differently.
    assert np.allclose(pose.rotations[0], answer.clip.rotations[4], rtol=0.0, atol=1e-12)
    assert np.allclose(pose.root_position[0], answer.clip.root_path[4], rtol=0.0, atol=1e-12)
    plain = poses.synthesize_poses(model, PoseQuestion(controls=middle(model), times=[0.2 * end]))
    assert not np.allclose(plain.rotations[0], answer.clip.rotations[4], atol=1e-4)


def test_targets_are_met_after_the_take(reach):
    mean, trust = clip(reach)
    hand = reach.session.card.skeleton.names.index("RightHand")
    goal = mean[-1, hand] + [0.02, 0.01, -0.02]
    rate = 10.0 / trust.duration
    target = Target("RightHand", tuple(goal), at="end")
    free, _ = clip(reach, fps=rate, take=SEED)
    held, said = clip(reach, fps=rate, take=SEED, targets=(target,))
    assert np.linalg.norm(free[-1, hand] - goal) > 0.01
    assert np.linalg.norm(held[-1, hand] - goal) < 1e-4
    assert all(met.reached for met in said.targets)
    assert apart(held, clip(reach, fps=rate, targets=(target,))[0]) > 1e-3


def test_a_target_within_reach_of_the_mean_is_within_reach_of_every_take(reach):
    mean, _ = clip(reach)
    hand = mean[-1, reach.session.card.skeleton.names.index("RightHand")]

    def reached(offset, **asked):
        goal = tuple((hand + np.array([0.0, 0.0, offset])).tolist())
        target = Target("RightHand", goal, at="end")
        return clip(reach, targets=(target,), extrapolate="ok", **asked)[1].targets[0].reached

    offsets = np.arange(0.0, 1.0, 0.01)
    farthest = max(offset for offset in offsets if reached(offset))
    assert not reached(farthest + 0.05)
    assert all(reached(farthest, take=seed, variety=1.0) for seed in range(1, 9))
    assert not any(reached(farthest + 0.05, take=seed, variety=1.0) for seed in range(1, 9))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"take": 10**9}, "take: 1000000000, expected 0 to 999999999"),
        ({"variety": float("nan")}, "variety: nan, expected 0 to 1"),
    ],
)
def test_seeds_and_varieties_out_of_range_are_refused(walk, asked, said):
    with pytest.raises(InvalidField) as caught:
        clip(walk, **asked)
    assert str(caught.value) == said


def test_a_spherical_covariance_has_no_takes(walk):
    card = walk.session.card
    spherical = replace(card, kriging=replace(card.kriging, covariance="spherical"))
    model = Synthesizer("walk", replace(walk.session, card=spherical))
    with pytest.raises(InvalidField, match="take: 7, but no takes can be drawn of spherical"):
        clip(model, take=SEED)


def lasting(reach, spread, durations):
    """The model of reaches with a spread of the durations of repeats."""
    card = reach.session.card
    making = replace(card.making, repeat_duration=spread)
    changed = replace(card, making=making, durations=durations)
    return Synthesizer("reach", replace(reach.session, card=changed))


def test_durations_of_takes_vary_as_those_of_repeats(reach):
    model, mean = lasting(reach, 0.2, (0.01, 100.0)), clip(reach)[1].duration
    variation = model.solver.variation

    def spread(variety):
        takes = [TakeSettings(seed, variety, detail=False) for seed in range(1, 401)]
        return np.std([np.log(variation.duration_factor(take, mean)) for take in takes])

    assert spread(1.0) == pytest.approx(0.2, rel=0.1)
    assert spread(0.5) == pytest.approx(0.5 * spread(1.0))
    narrow = lasting(reach, 0.2, (0.9 * mean, 1.05 * mean)).solver.variation
    found = [
        narrow.duration_factor(TakeSettings(seed, 1.0, detail=False), mean) for seed in range(1, 99)
    ]
    assert min(found) == pytest.approx(0.9) and max(found) == pytest.approx(1.05)
    # A motion of an older file, and one whose target is at a time, last as predicted.
    assert clip(lasting(reach, 0.0, (0.01, 100.0)), take=SEED)[1].duration == mean
    target = Target("RightHand", (0.3, 1.2, 0.4), 0.5 * mean)
    timed = clip(model, take=SEED, targets=(target,), extrapolate="ok")[1]
    assert timed.duration == pytest.approx(mean) and clip(model, take=SEED)[1].duration != mean


def test_a_slower_take_has_the_poses_of_the_same_shares_of_its_duration(reach):
    model = lasting(reach, 0.2, (0.01, 100.0))
    unvaried = lasting(reach, 0.0, (0.01, 100.0))

    def pose(model, seconds):
        asked = PoseQuestion(controls=middle(model), times=[seconds], take=SEED)
        return poses.synthesize_poses(model, asked)

    at = pose(unvaried, 0.4)
    duration = pose(model, 0.0).trust.duration
    factor = duration / at.trust.duration
    assert abs(factor - 1.0) > 0.02
    assert np.abs(pose(model, 0.4 * factor).rotations - at.rotations).max() < 1e-6
    assert np.abs(pose(model, 0.4).rotations - at.rotations).max() > 1e-4
    question = ClipQuestion(controls=middle(model), take=SEED)
    frames = len(clips.synthesize_clip(model, question).clip.rotations)
    assert clips.preview_clip(model, question).frames == frames
    act = act_motion.act_passage(model, question)
    assert len(act.passage) == pytest.approx(duration * passage.RATE, abs=2.0)


DEVIATIONS = np.outer([0.0, 0.02, 0.0, 0.01], np.linspace(1.0, 0.5, 14))


@pytest.fixture(scope="module")
def detailed(walk) -> Synthesizer:
    """The same with detail."""
    opened = walk.session
    making = replace(opened.card.making, detail=reduced_motion.to_bytes(DEVIATIONS))
    return Synthesizer("walk", replace(opened, card=replace(opened.card, making=making)))


def detailed_question(model, **more):
    controls = {c.name: c.default for c in model.session.card.controls}
    own = {"exact": "none", "feet": "as_predicted"}
    return ClipQuestion(controls=controls, fps=50.0, **own | more)


def detailed_clip(model, **more):
    """Joint positions (F, J, 3) of a clip with detail, and its trust."""
    answer = clips.synthesize_clip(model, detailed_question(model, **more))
    return answer.clip.positions(), answer.trust


def test_samples_have_the_deviations_and_close(rng):
    frames, seeds = 41, 400
    drawn = np.array([reduced_motion.sample(DEVIATIONS, frames, seed) for seed in range(seeds)])
    assert np.abs(drawn[:, 0] - drawn[:, -1]).max() < 1e-12
    variances = np.sum(np.square(DEVIATIONS), axis=0)
    ratios = np.mean(np.square(drawn), axis=(0, 1)) / variances
    assert np.allclose(ratios, 1.0, atol=0.2) and ratios.mean() == pytest.approx(1.0, abs=0.05)
    doubled = reduced_motion.sample(2.0 * DEVIATIONS, frames, SEED)
    assert np.allclose(doubled, 2.0 * drawn[SEED])


def test_detail_is_sampled_by_the_seed_of_the_take(detailed):
    mean, trust = detailed_clip(detailed)
    one, own = detailed_clip(detailed, detail=True)
    assert np.abs(one - mean).max() > 0.005 and own.sigma == trust.sigma
    assert np.array_equal(detailed_clip(detailed, detail=True)[0], one)
    taken, _ = detailed_clip(detailed, take=SEED)
    both, _ = detailed_clip(detailed, take=SEED, detail=True)
    assert np.abs(both - taken).max() > 0.005 and apart(both - taken, one - mean) > 1e-3
    assert own.warnings == ()


def test_a_loop_with_detail_closes(detailed):
    found, _ = detailed_clip(detailed, detail=True, loop=True, root="in_place")
    assert np.abs(found[-1] - found[0]).max() < 1e-9
    assert np.abs(found - detailed_clip(detailed, loop=True, root="in_place")[0]).max() > 0.005


def test_a_file_without_detail_answers_with_a_warning(walk):
    found, trust = detailed_clip(walk, detail=True)
    assert trust.warnings == (NO_DETAIL,)
    assert np.array_equal(found, detailed_clip(walk)[0])
