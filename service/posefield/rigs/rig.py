"""Rig: the skeleton of a character's file, with the roles of its joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from posefield.common.array_shapes import Positions, Rotations
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.rigs.joints.rest_joints import RestJoints
from posefield.roles.joint_recognition import RoleGuess

RigFormat = Literal["USD", "glTF"]


@dataclass(frozen=True)
class Rig:
    """Skeleton of a character's file.

    path: of the file. joint_paths (J,): of USD the tokens of the Skeleton's `joints`, such as
    "Hips/Spine"; of glTF the indices of the nodes as text. skeleton_path: of USD the path of the
    Skeleton; of glTF "". skins: of glTF the indices of the skins. rest: joints as the file has
    them at rest. roles: joint by role, with the confidence 1 for those that were stated. facing:
    direction of the body at rest, rad, to the left of +Z. notes: on what the reader assumed.
    """

    path: Path
    format: RigFormat
    joint_paths: tuple[str, ...]
    skeleton_path: str
    skins: tuple[int, ...]
    rest: RestJoints
    roles: Mapping[str, RoleGuess]
    facing: float
    notes: tuple[str, ...] = ()

    @property
    def skeleton(self) -> Skeleton:
        """Return the skeleton, at rest with identity rotations, in metres with Y up."""
        return self.rest.skeleton

    @property
    def joints(self) -> dict[str, int]:
        """Return the index of the joint of each role."""
        names = self.rest.names
        return {role: names.index(guess.joint) for role, guess in self.roles.items()}

    def file_rotations(self, clip: Clip) -> Rotations:
        """Return a clip's rotations (F, J, 4) as the file's joints have them, w x y z.

        clip: with the rig's skeleton. Each is local to the parent joint; the root's to its prim.
        """
        return self.rest.file_rotations(clip.rotations)

    def file_translations(self, clip: Clip) -> Positions:
        """Return a clip's translations (F, J, 3) as the file's joints have them, in its unit."""
        return self.rest.file_translations(clip.translations)
