"""Standing feet do not change the shipped walk: clips, a walker of a crowd, and performances."""

import pytest
import strides
from evaluation import stride_quality

SPEEDS = (0.6, 1.0, 1.4)


@pytest.fixture(scope="module")
def model():
    return strides.walk_model()


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("kind", strides.MOTIONS)
def test_pelvis_knees_and_legs_move_as_predicted(model, kind, speed):
    legs = strides.legs_of(model)
    before, after = (
        stride_quality.measure(strides.MOTIONS[kind](model, speed, feet), legs)
        for feet in ("as_predicted", "stand")
    )
    assert after.range < 1.05 * before.range
    # Characters that float by more than a centimetre are lowered to the ground as a whole.
    assert after.height > before.height - 1.4
    assert after.knee > min(before.knee, 170.0) - 4.0
    assert after.peak < 1.35 * before.peak or kind == "crowd"
    assert after.sole < max(before.sole, 0.7) + 0.2
    assert after.skate < 0.5 * before.skate


@pytest.mark.parametrize("speed", SPEEDS[:2])
def test_balls_that_land_first_pull_the_pelvis_down(model, speed):
    """The negative control: stances as they were planned before heels."""
    legs = strides.legs_of(model)
    before = stride_quality.measure(strides.clip(model, speed, "as_predicted"), legs)
    with strides.balls_down():
        after = stride_quality.measure(strides.clip(model, speed, "stand"), legs)
    assert after.range > 1.3 * before.range
