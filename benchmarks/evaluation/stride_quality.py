"""Measures of walking strides that a viewer sees: pelvis, knees, soles, legs and skate."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from posefield.common.units import UP, Floats
from posefield.encode.mannequin import mannequin
from posefield.encode.skinned_mesh import FULL_WEIGHT
from posefield.feet.limbs import Limb
from posefield.motion import contact_detection, quat, skeleton
from posefield.motion.clip import Clip


@dataclass(frozen=True)
class StrideQuality:
    """Measures of one motion.

    range, height: of the pelvis without drift, and its mean, cm. knee: at its straightest, degrees.
    sole: depth of the mannequin's lowest point below the floor, cm. peak: largest acceleration of a
    knee, ankle or ball relative to the root, m/s². skate: mean speed of planted feet, cm/s.
    """

    range: float
    height: float
    knee: float
    sole: float
    peak: float
    skate: float


def measure(clip: Clip, legs: Sequence[Limb]) -> StrideQuality:
    """Return the measures of a clip, at its rate."""
    positions = clip.positions()
    heights = positions[:, 0] @ UP
    line = np.polyval(np.polyfit(np.arange(len(heights)), heights, 1), np.arange(len(heights)))
    joints = [joint for leg in legs for joint in (leg.middle, leg.lower, leg.tip)]
    relative = positions[:, joints] - positions[:, :1]
    bends = np.linalg.norm(np.diff(relative, n=2, axis=0), axis=-1) * clip.rate**2
    feet = positions[:, [leg.tip for leg in legs]]
    return StrideQuality(
        100.0 * float(np.ptp(heights - line)),
        100.0 * float(heights.mean()),
        max(_knee_angles(positions, leg).max() for leg in legs),
        100.0 * max(0.0, -float(sole_heights(clip, legs).min())),
        float(bends.max()),
        100.0 * float(contact_detection.mean_skate_speed(feet, clip.rate)),
    )


def mean(measures: Sequence[StrideQuality]) -> StrideQuality:
    """Return the means over motions, and of soles the deepest."""
    columns = {name: [asdict(one)[name] for one in measures] for name in asdict(measures[0])}
    means = {name: float(np.mean(values)) for name, values in columns.items()}
    return StrideQuality(**{**means, "sole": max(columns["sole"])})


def _knee_angles(positions: Floats, leg: Limb) -> Floats:
    """Return the angles (F,) of a knee, degrees; 180 is straight."""
    thigh, shin = (positions[:, end] - positions[:, leg.middle] for end in (leg.upper, leg.lower))
    sizes = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)
    cosines = np.clip(np.sum(thigh * shin, axis=-1) / sizes, -1.0, 1.0)
    return np.asarray(np.degrees(np.arccos(cosines)))


def sole_heights(clip: Clip, legs: Sequence[Limb]) -> Floats:
    """Return the heights (F,), m, of the lowest points of a mannequin's feet."""
    bones = clip.translations[0].copy()
    bones[0] = clip.skeleton.offsets[0]
    body = replace(clip.skeleton, offsets=bones)
    mesh = mannequin(body)
    if mesh is None:
        raise ValueError("no mannequin, expected the skeleton of a person")
    feet = [joint for leg in legs for joint in (leg.lower, leg.tip)]
    weights = mesh.weights / FULL_WEIGHT
    points = np.flatnonzero(np.sum(weights * np.isin(mesh.joints, feet), axis=1) > 0.5)
    rest = body.at_rest(bones)
    positions, orientations = skeleton.forward_kinematics(
        body.parents, clip.rotations, clip.translations
    )
    heights = np.zeros((len(clip), len(points)))
    for joints, shares in zip(mesh.joints[points].T, weights[points].T, strict=True):
        arms = np.broadcast_to(mesh.points[points] - rest[joints], (len(clip), len(points), 3))
        skin = positions[:, joints] + quat.rotate(orientations[:, joints], arms)
        heights += shares * (skin @ UP)
    return np.asarray(heights.min(axis=1))
