"""Joint names by convention: each convention's name for each role of a joint.

Renaming is not retargeting: a skeleton of another convention has other bone axes and lengths, so
that a renamed motion still has to be retargeted.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import count
from typing import Literal, get_args

from posefield.common.errors import InvalidField
from posefield.motion.skeleton import Skeleton

NamingConvention = Literal["own", "mixamo", "ue5", "vrm", "humanik"]
"""Naming convention of joints: the motion files' own names, or those of another tool."""

# Named as the bones of a VRM humanoid; fingers, eyes and jaw are left out.
Role = Literal[
    "hips",
    "spine",
    "chest",
    "upperChest",
    "neck",
    "head",
    "leftShoulder",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "leftUpperLeg",
    "leftLowerLeg",
    "leftFoot",
    "leftToes",
    "rightShoulder",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "rightToes",
]
ROLES: tuple[str, ...] = get_args(Role)

# Role; HumanIK, which Mixamo uses with a prefix; Unreal's mannequin.
_TRUNK = (
    ("hips", "Hips", "pelvis"),
    ("spine", "Spine", "spine_01"),
    ("chest", "Spine1", "spine_03"),
    ("upperChest", "Spine2", "spine_05"),
    ("neck", "Neck", "neck_01"),
    ("head", "Head", "head"),
)
_SIDE = (
    ("Shoulder", "Shoulder", "clavicle"),
    ("UpperArm", "Arm", "upperarm"),
    ("LowerArm", "ForeArm", "lowerarm"),
    ("Hand", "Hand", "hand"),
    ("UpperLeg", "UpLeg", "thigh"),
    ("LowerLeg", "Leg", "calf"),
    ("Foot", "Foot", "foot"),
    ("Toes", "ToeBase", "ball"),
)
_ROLE_NAMES = (
    *_TRUNK,
    *(("left" + role, "Left" + humanik, ue5 + "_l") for role, humanik, ue5 in _SIDE),
    *(("right" + role, "Right" + humanik, ue5 + "_r") for role, humanik, ue5 in _SIDE),
)

NAMES_BY_CONVENTION: dict[str, dict[str, str]] = {
    "mixamo": {role: "mixamorig:" + humanik for role, humanik, _ in _ROLE_NAMES},
    "ue5": {role: ue5 for role, _, ue5 in _ROLE_NAMES},
    "vrm": {role: role for role, _, _ in _ROLE_NAMES},
    "humanik": {role: humanik for role, humanik, _ in _ROLE_NAMES},
}
"""Each convention's name for each role."""


def rename_joints(
    skeleton: Skeleton, roles: Mapping[str, str], names: NamingConvention
) -> Skeleton:
    """Return the skeleton with a convention's names for the joints that have a role.

    roles: joint name by role. The other joints keep their names, with the ending _2, _3 and so on
    where the name is taken by a renamed or an earlier joint. Raises InvalidField for a convention
    if the model has no roles.
    """
    if names == "own":
        return skeleton
    if not roles:
        raise InvalidField(
            "names", f"{names!r}, expected 'own': this model's recipe gives its joints no [roles]"
        )
    said = {joint: NAMES_BY_CONVENTION[names][role] for role, joint in roles.items()}
    return replace(skeleton, names=_unique_names(skeleton.names, said))


def _unique_names(names: Iterable[str], said: Mapping[str, str]) -> tuple[str, ...]:
    given, taken = list(names), set(said.values())
    # Names that are not taken are kept first, so that no ending of another joint takes them.
    taken |= (kept := {name for name in given if name not in said and name not in taken})
    return tuple(
        said.get(name) or (name if name in kept else _unused_name(name, taken)) for name in given
    )


def _unused_name(name: str, taken: set[str]) -> str:
    found = next(ending for n in count(2) if (ending := f"{name}_{n}") not in taken)
    taken.add(found)
    return found
