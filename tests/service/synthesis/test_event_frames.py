"""Frames at events and targets, as the files of clips have them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from posefield.constraints.targets import NO_CONSTRAINTS
from posefield.inference import session
from posefield.model_file.model_card import Event
from posefield.motion import skeleton as forward
from posefield.question.motion_question import ClipQuestion, PoseQuestion, Target
from posefield.synthesis import clip_draft, clips, poses
from posefield.synthesis.synthesizer import Synthesizer

EXACT = 2e-5
RATES = (24.0, 29.97, 30.0, 60.0)
SECONDS = st.floats(0.05, 4.0)


@given(
    st.floats(1.0, 240.0), SECONDS, st.floats(0.0, 1.0), st.lists(st.floats(0.0, 1.0), max_size=4)
)
def test_frames_lie_on_moments_and_move_by_half_a_step_at_most(rate, duration, begin, shares):
    start, moments = begin * duration, [share * duration for share in shares]
    played = clip_draft.playback(rate, start, duration, moments)
    times = played.times(played.duration)
    even = start + np.arange(len(times)) / rate
    assert np.abs(times - even).max() <= 0.5 / rate + 1e-9
    assert (np.diff(times) >= -1e-9).all()
    for index, moment in enumerate(moments):
        frame = round((moment - start) * rate)
        if frame >= 0 and frame not in [round((m - start) * rate) for m in moments[:index]]:
            assert times[frame] == pytest.approx(moment, abs=1e-12)
    # Negative control: without moments, frames are at equal times.
    plain = clip_draft.playback(rate, start, duration, [])
    assert plain.duration == pytest.approx(duration)
    assert plain.stretch(plain.times(duration)) == 0.0


@pytest.fixture(scope="module")
def reach(labelled_path) -> Synthesizer:
    return Synthesizer("reach", session.load(labelled_path))


@pytest.fixture(scope="module")
def early(reach) -> Synthesizer:
    """The reach with an event inside."""
    card = reach.session.card
    card = replace(card, event=Event(card.event.joint, 0.4))
    return Synthesizer("early", replace(reach.session, card=card))


@pytest.fixture(scope="module")
def walk(walk_path) -> Synthesizer:
    return Synthesizer("walk", session.load(walk_path))


def middle(model):
    return {c.name: c.default for c in model.session.card.controls}


def clip(model, **asked):
    return clips.synthesize_clip(model, ClipQuestion(controls=middle(model), **asked))


def pose(model, *times, **asked):
    question = PoseQuestion(controls=middle(model), times=list(times), **asked)
    return poses.synthesize_poses(model, question)


def distances(model, poses, target):
    """Distances (F,), m, of a joint from its target in poses."""
    skeleton = model.session.card.skeleton
    translations = forward.translations(poses.bone_offsets, poses.root_position)
    positions = forward.positions(skeleton.parents, poses.rotations, translations)
    return np.linalg.norm(
        positions[:, skeleton.names.index(target.joint)] - target.position, axis=-1
    )


def frames(model, answer, target):
    """Distances (F,), m, of a joint from its target in the frames of a clip."""
    joint = model.session.card.skeleton.names.index(target.joint)
    return np.linalg.norm(answer.clip.positions()[:, joint] - target.position, axis=-1)


def near(model, joint, share, apart):
    """Target of a joint `apart` from its place at a share of the motion, m."""
    free, names = clip(model, fps=600.0), model.session.card.skeleton.names
    path = free.clip.positions()[:, names.index(joint)]
    place = path[round((len(path) - 1) * share)] + apart
    when = {"at": "end"} if share == 1.0 else {"time": share * free.trust.duration}
    return Target(joint, tuple(place), **when)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize(
    ("kind", "joint", "apart"),
    [("reach", "RightHand", 0.02), ("early", "RightHand", 0.02), ("walk", "LeftFoot", 0.003)],
)
def test_a_target_is_met_in_a_frame(kind, joint, apart, rate, request):
    model, between = request.getfixturevalue(kind), []
    duration = pose(model, 0.0).trust.duration
    for target in (near(model, joint, share, apart) for share in (1.0, 0.61)):
        asked = {"exact": "none", "targets": (target,)}
        answer = clip(model, fps=rate, **asked)
        (told,) = answer.trust.targets
        assert told.reached and frames(model, answer, target).min() == pytest.approx(told.miss)
        assert told.miss < EXACT and answer.trust.stretch <= 0.5 / rate
        # Negative control: frames at equal times lie beside it.
        even = pose(model, *np.arange(0.0, duration, 1.0 / rate), **asked)
        between.append(distances(model, even, target).min())
    assert max(between) > 5.0 * EXACT


def test_an_extreme_and_an_event_inside_have_frames(early):
    asked = {"exact": "none", "fps": 24.0}
    free = clip(early, **asked)
    hand = free.clip.positions()[:, early.session.card.skeleton.names.index("RightHand")]
    for when, place in (("farthest", hand[-1]), ("event", hand[round(0.4 * len(hand))])):
        target = Target("RightHand", tuple(place + 0.02), at=when)
        answer = clip(early, targets=(target,), **asked)
        assert answer.trust.targets[0].reached
        assert frames(early, answer, target).min() < EXACT
    # Without a target, the frame of the event is the pose at the event.
    question = early.question(ClipQuestion(controls=middle(early)))
    at = np.array([0.4 * (early.session.card.frames - 1)])
    (moment,) = early.solver.times(question, early.solver.solve(question, NO_CONSTRAINTS), at)
    assert (
        np.abs(free.clip.rotations[round(moment * 24.0)] - pose(early, moment).rotations).max()
        < 1e-5
    )


def test_a_motion_with_an_event_ends_on_a_frame_and_tells_so(reach):
    duration = pose(reach, 0.0).trust.duration
    for rate in RATES:
        answer = clip(reach, fps=rate)
        assert answer.trust.duration == pytest.approx((len(answer.clip) - 1) / rate)
        assert answer.trust.stretch == pytest.approx(
            abs(answer.trust.duration - duration), abs=1e-6
        )
        assert np.abs(answer.clip.rotations[-1] - pose(reach, duration).rotations[0]).max() < 1e-5
        window = clip(reach, fps=rate, start=3 / rate, end=answer.trust.duration)
        assert np.allclose(window.clip.rotations, answer.clip.rotations[3:], atol=1e-5)
        assert "stretch" in answer.trust.facts()
    # Less than half a frame has its first pose alone.
    assert len(clip(reach, fps=1.0, start=duration - 0.4).clip) == 1


def test_a_cycle_keeps_its_speed(walk):
    duration = pose(walk, 0.0).trust.duration
    plain = clip(walk, fps=30.0)
    assert plain.trust.duration == duration and "stretch" not in plain.trust.facts()
    assert len(plain.clip) == int(30.0 * duration) + 1
    loop = clip(walk, fps=30.0, loop=True)
    steps = len(loop.clip) - 1
    assert loop.trust.duration == duration
    assert loop.trust.stretch == pytest.approx(abs(steps / 30.0 - duration), abs=1e-6)
    target = near(walk, "LeftFoot", 0.61, 0.003)
    held = clip(walk, fps=30.0, loop=True, exact="none", targets=(target,))
    assert held.trust.targets[0].reached and len(held.clip) == steps + 1
    assert frames(walk, held, target).min() < EXACT


def test_of_two_moments_in_one_frame_the_second_tells_its_distance(reach):
    first = near(reach, "RightHand", 0.61, 0.02)
    second = near(reach, "LeftHand", 0.62, 0.0)
    answer = clip(reach, fps=10.0, exact="none", targets=(first, second))
    one, two = answer.trust.targets
    assert one.reached and one.miss < EXACT
    frame = np.argmin(frames(reach, answer, first))
    assert two.miss == pytest.approx(frames(reach, answer, second)[frame])
    assert two.miss > EXACT
