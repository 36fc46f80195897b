"""Tests of durations that clients round to float32: the end of a clip stays valid."""

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

POINTS = 40
# Single precision has 24 bits: two steps above a number lie beyond its rounding.
STEPS = 2


@pytest.fixture(scope="module", params=["model_path", "walk_path"])
def model(request) -> Synthesizer:
    path = request.getfixturevalue(request.param)
    return model_registry.load([path]).models[path.stem]


def sampled(model, rng):
    """Controls within what was sampled."""
    found = {c.name: rng.uniform(c.minimum, c.maximum) for c in model.session.card.controls}
    return {name: float(value) for name, value in found.items()}


def pose(model, controls, *times, **more):
    return poses.synthesize_poses(
        model, PoseQuestion(controls=controls, times=times, extrapolate="ok", **more)
    )


def as_float32(number):
    """The number as a client writes it that keeps float32: in the fewest digits that tell it."""
    return float(str(np.float32(number)))


def assert_same_poses(a, b):
    assert np.array_equal(a.times, b.times)
    assert a.rotations.tobytes() == b.rotations.tobytes()
    assert a.root_position.tobytes() == b.root_position.tobytes()


def test_a_duration_as_float32_is_the_duration(model, rng):
    above = 0
    for controls in (sampled(model, rng) for _ in range(POINTS)):
        duration = pose(model, controls, 0.0).trust.duration
        written = as_float32(duration)
        above += written > duration
        end = pose(model, controls, written)
        assert end.times.tolist() == [min(written, duration)]
        if written > duration:
            assert_same_poses(end, pose(model, controls, duration))
        whole = clips.synthesize_clip(model, ClipQuestion(controls=controls, end=written)).clip
        assert len(whole) == len(clips.synthesize_clip(model, ClipQuestion(controls=controls)).clip)
        last = clips.synthesize_clip(model, ClipQuestion(controls=controls, start=written)).clip
        assert len(last) == 1
    # Negative control: without slack these would have been refused.
    assert above > POINTS / 10


@pytest.mark.parametrize("field", ["times/1", "end", "start"])
def test_what_is_later_is_refused_in_digits_that_differ(model, rng, field):
    controls = sampled(model, rng)
    duration = pose(model, controls, 0.0).trust.duration
    if field == "end":
        played = clips.synthesize_clip(model, ClipQuestion(controls=controls)).trust.duration
        duration = max(duration, np.float32(played))
    late = np.float32(duration)
    for _ in range(STEPS):
        late = np.nextafter(late, np.float32(np.inf))
    with pytest.raises(InvalidField) as caught:
        if field == "times/1":
            pose(model, controls, 0.0, float(late))
        else:
            clips.synthesize_clip(model, ClipQuestion(controls=controls, **{field: float(late)}))
    assert caught.value.field == field
    found, _, bound = caught.value.message.partition(" s, expected 0 to ")
    assert float(found) > float(bound.removesuffix(" s"))
    assert np.float32(float(found)) == late and np.float32(float(bound[:-2])) == duration
