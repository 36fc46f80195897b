"""Rig: the skeleton of a character's USD or glTF file, with the roles of its joints.

Roles are recognised or stated; refusals say what to state.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np

from posefield.common.errors import MotionFileError, did_you_mean
from posefield.common.units import Vector
from posefield.motion.joint_roles import ROLES
from posefield.motion.skeleton import Skeleton, joint_chain
from posefield.rigs import rest_joints
from posefield.rigs.rest_joints import RestJoints
from posefield.roles import joint_recognition
from posefield.roles.joint_recognition import LOWEST_CONFIDENCE, NEEDED, SIDES, RoleGuess

LEG = ("UpperLeg", "LowerLeg", "Foot")
ARM = ("UpperArm", "LowerArm", "Hand")
CHAINS = tuple(
    tuple(side + part for part in parts) for side in SIDES for parts in ((*LEG, "Toes"), ARM)
)
"""Roles of limbs: each joint is below that of the role before it."""
SHOWN = 12
HOW = "state them by role, such as leftUpperLeg=thigh_l"
LEG_LENGTHS = (0.2, 2.5)
"""Usual lengths of the legs of characters, m."""


def find_roles(
    source: str, skeleton: Skeleton, paths: Sequence[str], stated: Mapping[str, str]
) -> tuple[dict[str, RoleGuess], float, tuple[str, ...]]:
    """Return the joint of a rig by role, the facing at rest, rad, to the left of +Z, and notes.

    Notes are on roles that are left out, and on an unusual size. paths (J,): other names by which
    joints may be stated. stated: joint by role; others are recognised. Raises MotionFileError for
    unknown roles and joints, for a body without hips and two legs, and for roles of limbs that are
    not sure.
    """
    stated_guesses = _stated(source, skeleton, paths, stated)
    recognised = joint_recognition.recognise(skeleton.names, skeleton.parents)
    used_joints = {guess.joint for guess in stated_guesses.values()}
    recognised = {
        role: role_guess
        for role, role_guess in recognised.items()
        if role_guess.joint not in used_joints or role in stated_guesses
    }
    guesses = {
        role: (recognised | stated_guesses)[role]
        for role in ROLES
        if role in recognised | stated_guesses
    }
    positions = skeleton.at_rest(skeleton.offsets)[None]
    checked = joint_recognition.check_shape(guesses, skeleton.names, positions)
    checked |= stated_guesses
    if stated_guesses:
        _check_order(source, skeleton, checked)
    _refuse_unsure(source, checked, skeleton.names)
    unsure = {role: role_guess for role, role_guess in checked.items() if not role_guess.is_sure}
    sure = {role: role_guess for role, role_guess in checked.items() if role_guess.is_sure}
    _check_order(source, skeleton, sure)
    notes = tuple(
        f"{role} may be {role_guess.joint!r}, but it is not sure ({role_guess.confidence:.2f} of "
        f"{LOWEST_CONFIDENCE}): left out, {HOW}"
        for role, role_guess in unsure.items()
    )
    left, right = (_position(skeleton, sure[side + "UpperLeg"]) for side in SIDES)
    return sure, facing_of(left - right), notes + _notes_on_size(skeleton, sure)


def _stated(
    source: str, skeleton: Skeleton, paths: Sequence[str], stated: Mapping[str, str]
) -> dict[str, RoleGuess]:
    """Return stated roles with full confidence."""
    guesses: dict[str, RoleGuess] = {}
    names_of = dict(zip(paths, skeleton.names, strict=True)) | {
        name: name for name in skeleton.names
    }
    for role, joint in stated.items():
        if role not in ROLES:
            raise MotionFileError(
                source,
                f"found the role {role!r}{did_you_mean(role, ROLES)}, expected one of "
                f"{', '.join(ROLES)}",
            )
        if joint not in names_of:
            raise MotionFileError(
                source, f"found no joint {joint!r} for {role}{did_you_mean(joint, names_of)}"
            )
        other = next(
            (name for name, guess in guesses.items() if guess.joint == names_of[joint]), None
        )
        if other is not None:
            raise MotionFileError(
                source, f"found joint {joint!r} for {other} and {role}, expected one for each"
            )
        guesses[role] = RoleGuess(names_of[joint], 1.0)
    return guesses


def _refuse_unsure(source: str, guesses: Mapping[str, RoleGuess], names: Sequence[str]) -> None:
    """Raise MotionFileError for needed roles that are missing, and roles of limbs not sure."""
    missing = [role for role in NEEDED if role not in guesses]
    if missing:
        shown_names = ", ".join(names[:SHOWN]) + (", ..." if len(names) > SHOWN else "")
        raise MotionFileError(
            source,
            f"found no joint for {', '.join(missing)} among {shown_names}; "
            f"expected hips and two legs: {HOW}",
        )
    limbs = {role for chain in CHAINS for role in chain[:3]} | {"hips"}
    unsure = {role: guess for role, guess in guesses.items() if role in limbs and not guess.is_sure}
    if unsure:
        # The least sure first: the others often follow from them.
        ranked = sorted(unsure, key=lambda role: unsure[role].confidence)
        doubts = [f"{role} (perhaps {unsure[role].joint!r})" for role in ranked]
        remainder = f" and {len(doubts) - 4} more" if len(doubts) > 4 else ""
        reasons = dict.fromkeys(reason for guess in unsure.values() for reason in guess.reasons)
        raise MotionFileError(
            source,
            f"found no sure joint for {', '.join(doubts[:4])}{remainder}: "
            f"{'; '.join([*reasons][:3])}; expected a confidence of {LOWEST_CONFIDENCE}: {HOW}",
        )


def _check_order(source: str, skeleton: Skeleton, roles: Mapping[str, RoleGuess]) -> None:
    """Raise MotionFileError if a joint of a limb is not below the one before it."""
    joints = {role: skeleton.names.index(limb.joint) for role, limb in roles.items()}
    for chain in CHAINS:
        limb = ["hips", *chain]
        recognised = [role for role in limb if role in joints]
        for upper, lower in pairwise(recognised):
            if joints[upper] not in joint_chain(skeleton.parents, joints[lower])[:-1]:
                raise MotionFileError(
                    source,
                    f"found {lower} at {roles[lower].joint!r}, which is not below {upper} at "
                    f"{roles[upper].joint!r}; expected a chain: {HOW}",
                )


def facing_of(across: Vector) -> float:
    """Return the direction in which a body faces, rad, to the left of +Z.

    across: vector (3,) from its right upper leg to the left one.
    """
    return float(np.arctan2(-across[2], across[0]))


def _notes_on_size(skeleton: Skeleton, roles: Mapping[str, RoleGuess]) -> tuple[str, ...]:
    """Return a note on legs of an unusual length, which a wrong unit would have."""
    hip, foot = (_position(skeleton, roles[part]) for part in ("leftUpperLeg", "leftFoot"))
    length = float(np.linalg.norm(hip - foot))
    if LEG_LENGTHS[0] <= length <= LEG_LENGTHS[1]:
        return ()
    return (
        f"legs are {length:.3g} m long, usually {LEG_LENGTHS[0]} to {LEG_LENGTHS[1]} m: is "
        "the unit of the file right?",
    )


def _position(skeleton: Skeleton, guess: RoleGuess) -> Vector:
    """Return where a joint is at rest (3,), m."""
    positions: Vector = skeleton.at_rest(skeleton.offsets)[skeleton.names.index(guess.joint)]
    return positions


@dataclass(frozen=True)
class Rig:
    """Skeleton of a character's file.

    path: of the file. joint_paths (J,): of USD the tokens of the Skeleton's `joints`, such as
    "Hips/Spine"; of glTF the indices of the nodes as text. skeleton_path: of USD the path of the
    Skeleton; of glTF "". rest: joints as the file has
    them at rest. roles: joint by role, with the confidence 1 for those that were stated. facing:
    direction of the body at rest, rad, to the left of +Z. notes: on what the reader assumed.
    """

    path: Path
    format: Literal["USD", "glTF"]
    joint_paths: tuple[str, ...]
    skeleton_path: str
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


USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
GLTF_SUFFIXES = (".glb", ".gltf")
SUFFIXES = (*USD_SUFFIXES, *GLTF_SUFFIXES)
"""Suffixes of the files that are read, in lower case."""
NONE_STATED: Mapping[str, str] = MappingProxyType({})


def read_rig(path: Path, roles: Mapping[str, str] = NONE_STATED) -> Rig:
    """Return the rig of a character's file.

    roles: names of joints by role, or their paths in the file, where they are not to be
    recognised. Raises MotionFileError for a file that is none or cannot be read, without a
    skeleton or with several, without two legs, for scales that are animated, uneven or mirrored,
    and for roles that are not sure, with the way out.
    """
    suffix, source = path.suffix.lower(), str(path)
    if suffix not in SUFFIXES:
        raise MotionFileError(
            source, f"found the suffix {suffix!r}, expected one of {', '.join(SUFFIXES)}"
        )
    try:
        path.open("rb").close()
    except OSError as fault:
        raise MotionFileError(path, f"cannot be read: {fault.strerror}") from fault
    joint_names, prim = {name.rpartition("/")[2] for name in roles.values()}, ""
    with rest_joints.naming_faults(
        source, RuntimeError, ArithmeticError, TypeError, AttributeError, LookupError, ValueError
    ):
        # usd-core takes 0.12 s to import, pygltflib 0.1 s.
        if suffix in USD_SUFFIXES:
            from posefield.rigs import usd_rig

            rest, joints, prim, notes = usd_rig.read(path, source, joint_names)
        else:
            from posefield.rigs import gltf_rig

            rest, joints, notes = gltf_rig.read(path, source, joint_names)
        guesses, facing, role_notes = find_roles(source, rest.skeleton, joints, roles)
    form: Literal["USD", "glTF"] = "USD" if suffix in USD_SUFFIXES else "glTF"
    return Rig(path, form, joints, prim, rest, guesses, facing, notes + role_notes)
