"""Pelvis, spine and neck of a reach: their final poses, and their rotations at each phase."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield_train.sample import sample_body, sample_controls
from posefield_train.sample.sample_controls import SampleControls

_RESTING_SLOUCH = {"Hips": -0.12, "LowerBack": 0.08, "Spine": 0.06, "Spine1": 0.03}
"""Pitch of a sitting trunk at rest, rad."""

_YAW = {"LowerBack": 0.30, "Spine": 0.35, "Spine1": 0.35}
_LEAN = {"LowerBack": 0.40, "Spine": 0.35, "Spine1": 0.25}
_ROLL = {"LowerBack": 0.30, "Spine": 0.40, "Spine1": 0.30}
"""Shares of the spine's joints in the rotation that the pelvis leaves."""

_GAZE = {"Neck": 0.25, "Neck1": 0.30, "Head": 0.45}
"""Shares of the neck's joints in turning the head."""


@dataclass(frozen=True)
class TrunkDisplacement:
    """Final displacement of the trunk.

    low: height of the resting shoulder above the target, as a fraction of stature. yaw: left, rad.
    lean: forwards, rad. roll: right, rad. drop, shift: of the root, m.
    """

    low: float
    yaw: float
    lean: float
    roll: float
    drop: float
    shift: float


def _softplus(x: float, width: float) -> float:
    """Return a smooth form of max(x, 0)."""
    return width * float(np.logaddexp(0.0, x / width))


def trunk_displacement(controls: SampleControls) -> TrunkDisplacement:
    """Return the displacement of the trunk that brings the shoulder near to the target."""
    stature, upright = controls.stature, controls.uprightness
    low = (controls.hip_height + 0.27 * stature - controls.target_height) / stature
    lean = 0.06 + (3.9 - 1.9 * upright) * _softplus(low - 0.08, 0.08)
    # A right-handed reach brings the right shoulder forwards, which is a turn to the left.
    yaw = (0.68 + 0.08 * upright) * controls.azimuth + 0.17
    # The lean is not quite towards the target, because the pelvis turns less; roll sideways for it.
    aside = lean * np.sin(controls.azimuth - 0.6 * yaw)
    drop = stature * (0.004 + 0.48 * upright * _softplus(low - 0.18, 0.08))
    forwards = stature * (0.01 + 0.035 * upright)
    # The pelvis moves back under a leaning trunk to keep the centre of mass over the feet.
    backwards = stature * 0.09 * upright * lean
    return TrunkDisplacement(
        low=low,
        yaw=yaw,
        lean=lean,
        roll=0.32 * low - 0.6 * float(aside),
        drop=drop,
        shift=forwards - backwards,
    )


def root_path(controls: SampleControls, goal: TrunkDisplacement, u: Floats) -> Floats:
    """Return root positions (P, 3), m: from above the origin towards the target, and down."""
    heading = 0.5 * controls.azimuth
    displacement = np.array(
        [goal.shift * np.sin(heading), -goal.drop, goal.shift * np.cos(heading)]
    )
    start = np.array([0.0, controls.hip_height, 0.0])
    path: Floats = start + sample_controls.trunk(u)[:, None] * displacement
    return path


def rotations(controls: SampleControls, goal: TrunkDisplacement, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) of pelvis and spine."""
    pelvis = np.array(
        [0.12 + 0.26 * controls.uprightness, 0.42 - 0.02 * controls.uprightness, 0.15]
    )
    total = np.array([goal.yaw, goal.lean, goal.roll])
    shares = {
        name: (1.0 - pelvis) * np.array([_YAW[name], _LEAN[name], _ROLL[name]])
        for name in sample_body.SPINE
    }
    progress = sample_controls.trunk(u)[:, None]
    sitting = np.array([0.0, 1.0 - controls.uprightness, 0.0])
    return {
        name: quat.from_euler(_RESTING_SLOUCH[name] * sitting + progress * share * total, "YXZ")
        for name, share in {"Hips": pelvis, **shares}.items()
    }


def neck_rotations(to_target: Floats, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) that turn the gaze to the target.

    to_target: (P, 3), from the neck's base to the target, in the chest's frame.
    """
    x, y, z = np.moveaxis(to_target, -1, 0)
    yaw, pitch = np.arctan2(x, z), -np.arctan2(y, np.hypot(x, z))
    progress = sample_controls.gaze(u)
    tilt = -0.12 * yaw
    look = progress[:, None] * np.stack([yaw, pitch, tilt], axis=-1)
    return {name: quat.from_euler(share * look, "YXZ") for name, share in _GAZE.items()}
