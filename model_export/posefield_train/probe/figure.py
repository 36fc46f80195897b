"""Measurements of the figure in a motion file, in the file's own unit and axes."""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield.roles import body_shape, joint_recognition
from posefield.roles.joint_recognition import RoleGuess
from posefield_train.source import frame_faults
from posefield_train.source.motion_file import MotionFile

ADULT_LEG = 0.86
"""Length of the bones from hip to foot of an adult, m."""
OTHER_UNIT = 2.1
"""Least ratio of the legs of two bodies with the same joints that are in different units: legs of a
child and an adult differ by less, any two units by more."""
MAX_FRAMES = 200
"""Frames of a file that are measured, spread evenly."""
MOST_WHOLE, FEW = 50, 5
"""Files with the same joints of which all measured frames are kept, and frames of each further one:
ten thousand files would take gigabytes."""


@dataclass(frozen=True)
class Figure:
    """A file's figure.

    guesses: joints by role, with confidence. positions: of the joints (F, J, 3), in some of the
    frames. bones: length (J,) of the bone that leads to each joint. turns: rotations (F, 4) of the
    root. moves: whether position channels of each joint (J,) change. frames: number of the file's.
    """

    file: MotionFile
    guesses: dict[str, RoleGuess]
    positions: Floats
    bones: Floats
    turns: Floats
    moves: tuple[bool, ...]
    frames: int

    @property
    def names(self) -> list[str]:
        """Return the names of the joints."""
        return list(self.file.skeleton.names)

    @property
    def roles(self) -> dict[str, str]:
        """Return the joint of each role that seems right, however surely."""
        return {role: guess.joint for role, guess in self.guesses.items()}

    @property
    def sure_roles(self) -> dict[str, str]:
        """Return the joint of each role that needs no confirmation."""
        return joint_recognition.sure_roles(self.guesses)

    def role(self, role: str) -> Floats | None:
        """Return the positions (F, 3) of the joint with a role, or None."""
        name = self.roles.get(role)
        return None if name is None else self.positions[:, self.names.index(name)]

    def pair(self, role: str) -> tuple[Floats, Floats] | None:
        """Return the positions (F, 3) of the left and the right joint of a role, or None."""
        left, right = self.role("left" + role), self.role("right" + role)
        return None if left is None or right is None else (left, right)

    def leg_length(self) -> float | None:
        """Return the length of the bones from the hip to the foot, in the file's unit, or None."""
        lengths = [self._chain(f"{side}UpperLeg", f"{side}Foot") for side in ("left", "right")]
        known = [length for length in lengths if length]
        return float(np.mean(known)) if known else None

    def _chain(self, upper: str, lower: str) -> float | None:
        if not {upper, lower} <= self.roles.keys():
            return None
        parents = self.file.skeleton.parents
        top, joint = (self.names.index(self.roles[role]) for role in (upper, lower))
        length = 0.0
        while joint > top:
            length += float(self.bones[joint])
            joint = parents[joint]
        return length if joint == top else None

    def without_frames(self) -> "Figure":
        """Return the figure with the first frame alone of its file, whose others take memory."""
        own = self.file
        first = replace(own, rotations=own.rotations[:1], translations=own.translations[:1])
        return replace(self, file=first)

    def with_few_frames(self) -> "Figure":
        """Return the figure with FEW of the frames that were measured."""
        few = np.unique(np.linspace(0, len(self.positions) - 1, FEW).round().astype(int))
        return replace(self, positions=self.positions[few], turns=self.turns[few])

    @property
    def size(self) -> float:
        """Return the largest extent of the joints along an axis, in the file's unit."""
        return float(np.median(np.ptp(self.positions, axis=1).max(axis=-1)))


def measure(file: MotionFile) -> Figure:
    """Return the measurements of a file."""
    rotations, translations, joints = file.rotations, file.translations, file.skeleton
    picked = np.linspace(0, len(file) - 1, min(len(file), MAX_FRAMES)).round()
    frames = np.unique(picked.astype(int))
    positions = skeleton.positions(joints.parents, rotations[frames], translations[frames])
    guesses = joint_recognition.recognise(joints.names, joints.parents)
    moves = np.ptp(translations, axis=0).max(axis=-1) > 0.0
    return Figure(
        file,
        body_shape.check_shape(guesses, joints.names, positions),
        positions,
        np.linalg.norm(np.median(translations, axis=0), axis=-1),
        rotations[frames, 0],
        tuple(moves.tolist()),
        len(file),
    )


def faults(measured: Figure) -> list[str]:
    """Return the faults of the frames of a figure's file, which has its frames and a rate."""
    file, joints = measured.file, list(measured.sure_roles.values())
    leg = measured.leg_length()
    if file.rate is None or not leg:
        return []
    columns = [measured.names.index(joint) for joint in joints]
    bones = file.skeleton
    moved = skeleton.positions(bones.parents, file.rotations, file.translations)[:, columns]
    rest = bones.at_rest(bones.offsets)[columns]
    found = frame_faults.find_faults(moved * ADULT_LEG / leg, file.rate, rest * ADULT_LEG / leg)
    return frame_faults.describe(found, joints, file.rate)
