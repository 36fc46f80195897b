"""Facing: the horizontal direction in which a body faces while its root's heading is zero.

Training needs it, because heading, left and forward refer to it. A recipe states it, or asks to
measure it from the hips or from the travel; a motion that contradicts it is an error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.roles import joint_recognition

Facing = Literal["+x", "-x", "+z", "-z", "travel", "hips", "roles", "none"]
"""Axis of the root, or the evidence that tells it; none for motions without a facing."""
AXES = {"+z": 0.0, "+x": 90.0, "-z": 180.0, "-x": -90.0}
"""Angle of each axis to the left of +z, degrees."""

LARGEST_ANGLE = 45.0
"""Largest angle between a facing and the evidence, degrees: beyond it another axis is nearer."""
CLEAR_ANGLE = 30.0
"""Largest angle between evidence and an axis from which the axis is measured, degrees."""
CYCLE_WAY, WAY = 0.2, 0.5
"""Shortest travel that tells a facing, of a cycle and else, as a share of the body's size."""
AGREEMENT = 0.9
"""Least length of the mean of unit vectors that agree."""
LARGEST_LEAN = 120.0
"""Largest lean of the root, degrees, at which it has a heading."""
PAIRS = ("UpperLeg", "UpperArm", "Foot", "Hand")
"""Joints on either side by role, the best evidence first; upper legs are the hips."""


class FacingError(ValueError):
    """A facing that the motion contradicts, or that cannot be measured.

    clip: index of a clip that shows it.
    """

    def __init__(self, message: str, clip: int = 0) -> None:
        super().__init__(message)
        self.clip = clip


@dataclass(frozen=True)
class Evidence:
    """Direction of a family, measured.

    angles (N,): of the clips, degrees to the left of the root's +z; NaN where a clip tells nothing.
    mean: of the family. source: origin of the measurement. alternative: another recipe that the
    evidence may call for.
    """

    angles: Floats
    mean: float
    source: str
    alternative: str = ""

    @property
    def axis(self) -> str:
        """Return the nearest axis of the root."""
        return min(AXES, key=lambda axis: abs(_difference(self.mean, AXES[axis])))


def find_facing(
    clips: Sequence[Clip], facing: Facing | None, roles: Mapping[str, str], cyclic: bool
) -> tuple[float | None, tuple[str, ...]]:
    """Return the facing of a family's clips, which have one skeleton, and notes.

    The facing is in degrees to the left of the root's +z; None without one.

    facing: of the recipe; None means +z. roles: joints by role. Raises FacingError if the motion
    contradicts it, or does not tell it.
    """
    if facing == "none":
        return None, ()
    body = hips_evidence(clips, roles, facing == "roles")
    travel = travel_evidence(clips, cyclic)
    if facing in ("hips", "roles"):
        return _measured(body, facing, "two joints of a left and a right side", travel)
    if facing == "travel":
        degrees, notes = _measured(travel, facing, "clips that travel in one direction")
        _verify(body, degrees, "measured from the travel")
        return degrees, notes
    stated = "+z, the default," if facing is None else facing
    for evidence in (body, travel):
        _verify(evidence, AXES[facing or "+z"], f"stated as {stated}")
    unknown = body is None and travel is None and facing is None
    notes = ("nothing tells the facing: +z of the root is taken; say motion.facing",)
    return AXES[facing or "+z"], notes if unknown else ()


def _measured(
    evidence: Evidence | None, stated: str, needed: str, other: Evidence | None = None
) -> tuple[float, tuple[str, ...]]:
    """Return the axis of the evidence, degrees, and the notes."""
    if evidence is None:
        raise FacingError(f"motion.facing: found {stated!r}, but no evidence; expected {needed}")
    axis = evidence.axis
    deviation = _difference(evidence.mean, AXES[axis])
    if abs(deviation) > CLEAR_ANGLE:
        raise FacingError(
            f"motion.facing: {evidence.source} {_side(evidence.mean)} of the root's +z, between "
            "two axes; expected at most 30 degrees from one: turn the root in the files"
        )
    _verify(evidence, AXES[axis], f"measured as {axis}")
    notes = [f"facing {axis}: {evidence.source} {_side(evidence.mean)} of the root's +z"]
    if other is not None and abs(_difference(other.mean, AXES[axis])) > LARGEST_ANGLE:
        notes.append(f"{other.source} {_side(_difference(other.mean, AXES[axis]))} of the facing")
    return AXES[axis], tuple(notes)


def _verify(evidence: Evidence | None, degrees: float, origin: str) -> None:
    if evidence is None:
        return
    deviations = np.abs(_difference(evidence.angles, degrees))
    wrong = np.flatnonzero(deviations > LARGEST_ANGLE)
    if not len(wrong):
        return
    evidence_text = f"{evidence.source} {_side(evidence.mean)} of the root's +z"
    count = int(np.sum(np.isfinite(evidence.angles)))
    axis = evidence.axis
    if abs(_difference(evidence.mean, degrees)) <= LARGEST_ANGLE:
        first = int(wrong[0])
        evidence_text += f", but in {len(wrong)} of {count} clips, such as this, "
        evidence_text += f"{_side(evidence.angles[first])}"
        hint = "files of one family have to face alike"
    else:
        evidence_text += f" in {len(wrong)} of {count} clips"
        hint = f"say motion.facing = '{axis}'{evidence.alternative}"
    raise FacingError(
        f"motion.facing: {origin} but {evidence_text}; expected at most {LARGEST_ANGLE:.0f} "
        f"degrees between them: {hint}",
        int(wrong[0]),
    )


def hips_evidence(
    clips: Sequence[Clip], roles: Mapping[str, str], only_roles: bool = False
) -> Evidence | None:
    """Return the direction in which a pair of joints faces; None without such a pair.

    roles: joints by role; other joints are recognised by their names unless `only_roles`.
    """
    joints = clips[0].skeleton
    recognised = {} if only_roles else joint_recognition.roles_of(joints.names, joints.parents)
    by_role = {
        role: joint for role, joint in (recognised | dict(roles)).items() if joint in joints.names
    }
    for pair in PAIRS:
        sides = [by_role.get(f"{side}{pair}") for side in ("left", "right")]
        if not all(sides):
            continue
        left, right = (joints.names.index(str(side)) for side in sides)
        source = f"the line from {sides[1]!r} to {sides[0]!r} faces"
        evidence = _evidence([_pair_vector(clip, left, right) for clip in clips], source)
        if evidence is not None:
            return evidence
    return None


def travel_evidence(clips: Sequence[Clip], cyclic: bool) -> Evidence | None:
    """Return the direction of travel of a family; None if its clips stay or travel anywhere."""
    vectors = np.array([_travel_vector(clip) for clip in clips])
    size = float(np.median([np.ptp(clip.positions(), axis=1).max() for clip in clips]))
    shortest = max((CYCLE_WAY if cyclic else WAY) * size, 1e-3)
    if np.median(np.abs(vectors)) < shortest:
        return None
    if abs(vectors.sum()) < AGREEMENT * np.abs(vectors).sum():
        return None
    mean = float(np.degrees(np.angle(vectors.sum())))
    distance = float(np.mean(np.abs(vectors)))
    # Single clips may turn or step aside: the family's direction counts.
    source = f"the clips travel {distance:.2f} m (mean)"
    sideways = ", or 'hips' for a body that moves sideways or backwards"
    return Evidence(np.full(len(clips), mean), mean, source, sideways)


def _evidence(vectors: Sequence[complex], source: str) -> Evidence | None:
    """Return the evidence of mean directions, complex numbers of length 0 to 1."""
    clear = np.array([vector if abs(vector) > 0.5 else np.nan for vector in vectors])
    if not np.isfinite(clear).any():
        return None
    mean = float(np.degrees(np.angle(np.nansum(clear))))
    return Evidence(np.asarray(np.degrees(np.angle(clear))), mean, source)


def _upright_turn(clip: Clip) -> Annotated[Floats, "frames"]:
    """Return the heading (F,) of the root, rad; NaN in frames in which it is upside down."""
    turns = clip.rotations[:, 0]
    lean = 2.0 * np.degrees(
        np.arctan2(np.hypot(turns[:, 1], turns[:, 3]), np.hypot(*turns[:, ::2].T))
    )
    return np.where(lean > LARGEST_LEAN, np.nan, quat.twist(turns, UP))


def _pair_vector(clip: Clip, left: int, right: int) -> complex:
    """Return the mean direction in which a pair of joints faces, of length 0 to 1.

    The argument is its angle to the left of the root's +z. Short if the pair is not level, or the
    body bends between them and the root.
    """
    positions = clip.positions()
    across = positions[:, left] - positions[:, right]
    lengths = np.linalg.norm(across, axis=-1)
    if lengths.max() < 1e-6:
        return 0.0
    # Forward is left turned by a quarter: x to z, and z to -x.
    forward = (across[:, 0] - 1j * across[:, 2]) / np.maximum(lengths, 1e-6)
    relative = forward * np.exp(-1j * _upright_turn(clip))
    return complex(np.nanmean(relative)) if np.isfinite(relative).any() else 0.0


def _travel_vector(clip: Clip) -> complex:
    """Return the way of the root, m; the argument is its angle to the left of the root's +z."""
    displacement = clip.root_path[-1] - clip.root_path[0]
    turn = _upright_turn(clip)
    turn = turn[np.isfinite(turn)]
    if not len(turn):
        return 0.0
    mean = np.mean(np.exp(1j * turn))
    return complex((displacement[2] + 1j * displacement[0]) * np.exp(-1j * np.angle(mean)))


def _difference(a: Floats | float, b: float) -> Floats:
    """Return the angle from b to a, degrees, from -180 to 180."""
    return np.asarray((np.asarray(a) - b + 180.0) % 360.0 - 180.0)


def _side(degrees: Floats | float) -> str:
    value = round(float(degrees))
    if value == 0:
        return "along the direction"
    return f"{abs(value)} degrees to the {'left' if value > 0 else 'right'}"


def turn_basis(clip: Clip, degrees: float) -> Clip:
    """Return the clip in a basis in which a facing, degrees to the left of +z, is +z.

    Every offset and rotation is turned, so that the rest pose faces +z too.
    """
    if degrees == 0.0:
        return clip
    back = quat.from_axis_angle(UP, np.radians(-degrees))
    joints = clip.skeleton
    rotations = clip.rotations.copy()
    rotations[..., 1:] = quat.rotate(back, rotations[..., 1:])
    turned = replace(
        joints,
        offsets=quat.rotate(back, joints.offsets),
        tip_offsets=quat.rotate(back, joints.tip_offsets),
    )
    return replace(
        clip,
        skeleton=turned,
        rotations=rotations,
        translations=quat.rotate(back, clip.translations),
    )
