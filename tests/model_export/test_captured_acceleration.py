"""Tests of the accelerations of captured clips on the model card."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.model_file import model_card
from posefield.model_file.model_card import ACCELERATION_RATE
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.graph.trained_card import clip_accelerations

ARM = 0.5
PENDULUM = Skeleton(
    ("root", "joint"), (-1, 0), np.array([[0.0, 1.0, 0.0], [0.0, -ARM, 0.0]]), (), np.zeros((0, 3))
)
SWING, FREQUENCY = 0.4, 2.0 * np.pi
PRECISION = 0.02
"""Share of the largest acceleration by which a clip of another rate may differ."""


def swinging(rate, seconds=2.0):
    """Return a clip of a root that swings, so that its one joint moves on an arc."""
    times = np.arange(round(seconds * rate) + 1) / rate
    angles = SWING * np.sin(FREQUENCY * times)
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 2, 1))
    rotations[:, 0] = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), angles)
    places = np.tile(PENDULUM.offsets, (len(times), 1, 1))
    places[:, 0] = [0.0, 1.0, 0.0]
    return Clip(PENDULUM, rotations, places, rate)


def expected(count):
    """Return half the acceleration (count,) of a point on the arc, by its two parts."""
    times = np.arange(1, count + 1) / ACCELERATION_RATE
    speeds = SWING * FREQUENCY * np.cos(FREQUENCY * times)
    gains = -SWING * FREQUENCY**2 * np.sin(FREQUENCY * times)
    return ARM * np.hypot(gains, speeds**2) / 2.0


@pytest.mark.parametrize("rate", [30.0, 100.0, 119.88])
def test_clips_of_every_rate_have_the_acceleration_of_their_motion(rate):
    found = clip_accelerations(swinging(rate))
    assert len(found) == int(2.0 * ACCELERATION_RATE * (1.0 + 1e-9)) - 1
    right = expected(len(found))
    assert np.abs(found - right).max() < PRECISION * right.max()


def test_the_card_has_the_percentiles_over_all_frames(exported, trained):
    found = exported.card.captured_acceleration
    every = np.sort(np.concatenate([clip_accelerations(own.clip) for own in trained.examples]))
    assert found.median == pytest.approx(np.interp(0.5, np.linspace(0, 1, len(every)), every), 1e-3)
    assert found.p99 == pytest.approx(np.interp(0.99, np.linspace(0, 1, len(every)), every), 1e-3)
    # Negative control: the mean over the clips of their own percentiles is another number.
    own = np.mean([np.percentile(clip_accelerations(e.clip), 99) for e in trained.examples])
    assert found.p99 != pytest.approx(own, 1e-3)
    assert 0.0 < found.median < found.p99


def earlier_file(exported, folder):
    """Return the path of the model as a file of an earlier version."""
    old = replace(exported.card, captured_acceleration=None)
    path = folder / "old.onnx"
    path.write_bytes(exported.model.onnx(model_card.dump(old), {"producer_name": "posefield"}))
    return path


def test_inspect_tells_of_the_accelerations(model_path, exported, tmp_path, posefield):
    own = exported.card.captured_acceleration
    code, out, _ = posefield("inspect", model_path)
    assert code == 0
    assert f"median {own.median:.1f} m/s², 99th percentile {own.p99:.1f} m/s²" in out
    code, out, _ = posefield("inspect", earlier_file(exported, tmp_path))
    assert code == 0 and "accelerations" not in out
