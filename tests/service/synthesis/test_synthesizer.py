"""Tests of the synthesizer: answers, and errors with field and expectation."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import InvalidField, OutsideSamples
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.question.motion_question import replace as changed
from posefield.registry import model_registry
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

POINT = {"stature": 1.7, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}
# The graph answers in float32, and sums a batch in another order than one row.
FLOAT32 = 1e-5


@pytest.fixture(scope="module")
def model(model_path):
    return model_registry.load([model_path]).models["reaching"]


@pytest.fixture(scope="module")
def duration(model):
    return poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[0.0])).trust.duration


@pytest.fixture
def refused(model):
    """Function that expects a clip to be refused; gives the field and the message."""

    def of(controls=POINT, rate=30.0, **span):
        with pytest.raises(InvalidField) as caught:
            clips.synthesize_clip(
                model, ClipQuestion(controls=controls, fps=rate, extrapolate="warn", **span)
            )
        return caught.value.field, caught.value.message

    return of


def test_an_unknown_control_is_refused_with_those_there_are(refused):
    assert refused({**POINT, "speed": 1.0}) == (
        "controls/speed",
        "no such control; this model has stature, hip_height, turn, target_height",
    )


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (math.nan, "nan, expected a finite number"),
        (-math.inf, "-inf, expected a finite number"),
        (True, "True, expected a number"),
        ("1.7", "'1.7', expected a number"),
        (None, "None, expected a number"),
    ],
)
@pytest.mark.parametrize("name", ["stature", "turn"])
def test_a_control_that_is_no_finite_number_is_refused(refused, name, value, said):
    assert refused({**POINT, name: value}) == (f"controls/{name}", said)


@pytest.mark.parametrize("value", [1e30, -1e30, 2e4])
def test_a_control_out_of_all_reason_is_refused_with_the_range(refused, value):
    field, message = refused({**POINT, "turn": value})
    assert field == "controls/turn"
    assert message.startswith(f"{value:g} deg, expected -")
    assert re.search(r"expected -[0-9.]+ to [0-9.]+ deg$", message)


@pytest.mark.parametrize(("time", "inside"), [(-0.01, False), (0.0, True), (9.0, False)])
def test_a_time_outside_the_clip_is_refused(model, duration, time, inside):
    if inside:
        assert poses.synthesize_poses(
            model, PoseQuestion(controls=POINT, times=[time])
        ).times.tolist() == [time]
        return
    with pytest.raises(InvalidField) as caught:
        poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[0.1, time]))
    assert caught.value.field == "times/1"
    assert caught.value.message == f"{time:g} s, expected 0 to {duration:.9g} s"


@pytest.mark.parametrize("count", [0, 10_001])
def test_so_many_times_are_refused(model, count):
    with pytest.raises(InvalidField, match=f"times: {count} times, expected 1 to 10000"):
        poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[0.0] * count))


@pytest.mark.parametrize("rate", [0, -30, 0.5, 10_000, 1000.1, 1e300])
def test_a_rate_out_of_range_is_refused_with_the_range(refused, rate):
    expected = f"{rate:g} frames a second, expected 1 to 1000 frames a second"
    assert refused(rate=rate) == ("fps", expected)


def test_too_many_frames_are_refused_before_they_are_made(model):
    with pytest.raises(InvalidField) as caught:
        clips.synthesize_clip(model, ClipQuestion(controls=POINT, fps=1000.0), frame_limit=500)
    assert caught.value.field == "fps"
    assert re.fullmatch(r"\d{4} frames, expected at most 500", caught.value.message)


def test_an_absurd_duration_is_blamed_on_the_controls(model):
    """Of a file whose card tells far shorter clips than its graph makes."""
    card = replace(model.session.card, durations=(0.001, 0.002))
    odd = Synthesizer("odd", replace(model.session, card=card))
    with pytest.raises(OutsideSamples, match=r"clip would last \S+ s; captured clips last"):
        clips.synthesize_clip(odd, ClipQuestion(controls=POINT))


@pytest.mark.parametrize(
    ("span", "field", "said"),
    [
        ({"start": 0.8, "end": 0.5}, "start", "0.8 s, expected 0 to 0.5 s"),
        ({"start": -0.1}, "start", "-0.1 s, expected 0 to "),
        ({"end": 60.0}, "end", "60 s, expected 0 to "),
        ({"start": math.nan}, "start", "nan, expected a finite number"),
        ({"start": "0"}, "start", "'0', expected a number"),
    ],
)
def test_a_span_outside_the_clip_is_refused(refused, span, field, said):
    found, message = refused(**span)
    assert found == field
    assert message.startswith(said)


OUTSIDE = {**POINT, "turn": 120.0, "target_height": 0.1}


def test_outside_the_samples_each_control_has_its_sentence(model):
    warnings = poses.synthesize_poses(
        model, PoseQuestion(controls=OUTSIDE, times=[0.0], extrapolate="warn")
    ).trust.warnings
    assert len(warnings) == 2
    for warning, name in zip(warnings, ("turn", "target_height"), strict=True):
        own = model.session.card.control(name)
        assert warning == (
            f"{name} = {OUTSIDE[name]:g} {own.unit} lies outside what was sampled, "
            f"{own.minimum:g} to {own.maximum:g} {own.unit}"
        )


def test_outside_the_samples_a_client_may_ask_for_a_refusal(model):
    warnings = clips.synthesize_clip(
        model, ClipQuestion(controls=OUTSIDE, fps=30.0, extrapolate="warn")
    ).trust.warnings
    for ask in (
        lambda: clips.synthesize_clip(
            model, ClipQuestion(controls=OUTSIDE, fps=30.0, extrapolate="refuse")
        ),
        lambda: poses.synthesize_poses(
            model, PoseQuestion(controls=OUTSIDE, times=[0.0], extrapolate="refuse")
        ),
    ):
        with pytest.raises(OutsideSamples) as caught:
            ask()
        assert caught.value.field == "controls"
        assert caught.value.message == "; ".join(warnings)


def test_the_bounds_of_the_card_are_inside(model):
    for end in ("minimum", "maximum"):
        corner = {c.name: getattr(c, end) for c in model.session.card.controls}
        # Nobody is smallest, sitting and reaching lowest at once: a corner may be a gap.
        warnings = poses.synthesize_poses(
            model, PoseQuestion(controls=corner, times=[0.0], extrapolate="warn")
        ).trust.warnings
        assert not any("outside" in warning for warning in warnings)
        beyond = {**corner, "turn": 1.01 * corner["turn"]}
        assert (
            "outside"
            in poses.synthesize_poses(
                model, PoseQuestion(controls=beyond, times=[0.0], extrapolate="warn")
            ).trust.warnings[0]
        )


def between(model):
    """A point within the box that is like nothing captured: the hand high and the body sitting."""
    card = model.session.card
    rng = np.random.Generator(np.random.PCG64(4))
    low, high = np.transpose([(c.minimum, c.maximum) for c in card.controls])
    drawn = rng.uniform(low, high, (200, len(low)))
    point = drawn[np.argmin(model.validator.support.supported(drawn))]
    return {c.name: float(v) for c, v in zip(card.controls, point, strict=True)}


def test_a_gap_of_what_was_sampled_is_told_by_a_flag_and_as_it_was_asked_to(model):
    gap = between(model)
    ok, warned = (
        poses.synthesize_poses(
            model, PoseQuestion(controls=gap, times=[0.0], extrapolate=policy)
        ).trust
        for policy in ("ok", "warn")
    )
    assert not ok.supported and not warned.supported
    assert ok.warnings == ()
    assert len(warned.warnings) == 1 and "in a gap" in warned.warnings[0]
    with pytest.raises(OutsideSamples, match="in a gap") as caught:
        poses.synthesize_poses(model, PoseQuestion(controls=gap, times=[0.0], extrapolate="refuse"))
    assert caught.value.field == "controls"
    # Negative control: what was captured is answered whatever is asked.
    assert poses.synthesize_poses(
        model, PoseQuestion(controls=POINT, times=[0.0], extrapolate="refuse")
    ).trust.supported


def test_sigma_of_each_joint_is_its_share_of_sigma(model):
    trust = poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[0.0])).trust
    assert trust.joint_sigma == () and "joint_sigma" not in trust.facts()
    asked = ClipQuestion(controls=POINT, joint_sigma=True, fps=20.0 / trust.duration)
    found = clips.synthesize_clip(model, asked).trust
    card = model.session.card
    assert len(found.joint_sigma) == len(card.skeleton) == len(card.joint_sigma)
    shares = np.array(found.joint_sigma) / trust.sigma
    assert shares == pytest.approx(card.joint_sigma, abs=1e-4)
    assert np.sqrt(np.mean(np.square(shares))) == pytest.approx(1.0, abs=0.01)
    assert found.facts()["joint_sigma"] == found.joint_sigma
    pose = poses.synthesize_poses(
        model, PoseQuestion(controls=POINT, times=[0.0], joint_sigma=True)
    )
    assert pose.trust == found


@pytest.mark.parametrize("rate", [24.0, 30.0, 29.97, 120.0, 1.0])
def test_frame_i_is_the_pose_at_i_over_the_rate(model, duration, rate):
    # The last frame is the end, so that none is moved.
    rate = (round(duration * rate) + 1) / duration
    answer = clips.synthesize_clip(
        model, ClipQuestion(controls=POINT, fps=rate, extrapolate="warn")
    )
    frames = len(answer.clip)
    assert answer.clip.rate == rate
    assert (frames - 1) / rate == pytest.approx(duration) == answer.trust.duration
    assert answer.trust.stretch is None
    for frame in {0, frames // 2, frames - 1}:
        pose = poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[frame / rate]))
        assert np.abs(answer.clip.rotations[frame] - pose.rotations[0]).max() < FLOAT32
        assert np.abs(answer.clip.root_path[frame] - pose.root_position[0]).max() < FLOAT32
        assert np.abs(answer.clip.translations[frame, 1:] - pose.bone_offsets[1:]).max() < FLOAT32


def test_a_span_is_a_slice_of_the_whole(model):
    whole = clips.synthesize_clip(
        model, ClipQuestion(controls=POINT, fps=30.0, extrapolate="warn")
    ).clip
    part = clips.synthesize_clip(
        model, ClipQuestion(controls=POINT, fps=30.0, extrapolate="warn", start=0.2, end=0.7)
    ).clip
    assert len(part) == 16
    assert np.abs(part.rotations - whole.rotations[6:22]).max() < FLOAT32
    assert np.abs(part.translations - whole.translations[6:22]).max() < FLOAT32
    assert np.abs(part.rotations - whole.rotations[7:23]).max() > 100 * FLOAT32


def test_a_whole_rate_is_a_number_like_any_other(model):
    """Else text formats would write 30 or 30.0 of the same question."""
    rate = clips.synthesize_clip(model, ClipQuestion(controls=POINT, fps=30, end=0.0)).clip.rate
    assert repr(rate) == repr(30.0) != repr(30)


@pytest.mark.parametrize(
    ("asked", "field"),
    [
        (ClipQuestion(controls={**POINT, "turn": math.nan}), "controls/turn"),
        (ClipQuestion(controls=POINT, level=99), "level"),
        (ClipQuestion(controls=POINT, performer="nobody"), "performer"),
        (ClipQuestion(controls=POINT, fps=0.5), "fps"),
        (ClipQuestion(controls=POINT, start=0.5, end=0.4), "start"),
        (ClipQuestion(controls=POINT, end=1e6), "end"),
    ],
)
def test_what_a_clip_would_be_refused_for_is_said_before_it_is_made(model, asked, field):
    with pytest.raises(InvalidField) as before:
        clips.check(model, asked)
    with pytest.raises(InvalidField) as after:
        clips.synthesize_clip(model, asked)
    assert before.value.field == after.value.field == field


@pytest.mark.parametrize(
    "asked",
    [
        ClipQuestion(controls=POINT),
        ClipQuestion(controls=POINT, fps=7.3, start=0.11, end=0.77, level=2),
        ClipQuestion(controls={**POINT, "turn": 500.0, "stature": 1.0}, fps=1000),
    ],
)
def test_what_is_known_of_a_clip_before_it_is_made_is_true(model, asked):
    prospect, answer = clips.preview_clip(model, asked), clips.synthesize_clip(model, asked)
    assert prospect.frames == len(answer.clip)
    assert prospect.warnings == answer.trust.warnings


@pytest.mark.parametrize("level", [0, 1, 2])
def test_an_end_that_is_the_clips_own_is_known_to_be_one(model, rng, level):
    for _ in range(50):
        moved = {name: value * rng.uniform(0.9, 1.1) for name, value in POINT.items()}
        own = poses.synthesize_poses(
            model, PoseQuestion(controls=moved, times=[0.0], level=level)
        ).trust.duration
        clips.preview_clip(model, ClipQuestion(controls=moved, end=own, level=level))
        asked = ClipQuestion(controls=moved, level=level)
        own = max(own, clips.synthesize_clip(model, asked).trust.duration)
        clips.preview_clip(model, changed(asked, end=own))
        with pytest.raises(InvalidField, match="end: "):
            clips.preview_clip(model, changed(asked, end=own * (1.0 + 2.0**-22)))
