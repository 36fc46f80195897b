"""Joint names by convention: each convention's name for each role of a joint.

Renaming is not retargeting: a skeleton of another convention has other bone axes and lengths, so
that a renamed motion still has to be retargeted.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
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


def role_joints(joints: Skeleton, roles: Mapping[str, str]) -> dict[str, int]:
    """Return the index of the joint of each role; roles: joint name by role."""
    return {role: joints.names.index(name) for role, name in roles.items()}


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
    new_names = {joint: NAMES_BY_CONVENTION[names][role] for role, joint in roles.items()}
    used, counts = set(new_names.values()), Counter[str]()
    # Names that are not taken are kept first, so that no ending of another joint takes them.
    used |= (
        unchanged := {name for name in skeleton.names if name not in new_names and name not in used}
    )
    renamed = (
        new_names.get(name) or (name if name in unchanged else free_name(name, used, counts))
        for name in skeleton.names
    )
    return replace(skeleton, names=tuple(renamed))


def clean_names(names: Iterable[str], clean: Callable[[str], str]) -> tuple[str, ...]:
    """Return unique clean names in the given order; names that `clean` keeps are kept.

    Of several names that become equal, the later ones get the endings _2, _3, and so on.
    """
    originals = list(names)
    used = {name for name in originals if clean(name) == name}
    counts = Counter[str]()
    return tuple(n if n in used else free_name(clean(n), used, counts) for n in originals)


def free_name(name: str, used: set[str], counts: Counter[str] | None = None) -> str:
    """Return a name that is not taken; counts: the last ending tried, by name."""
    counts = Counter() if counts is None else counts
    while True:
        counts[name] += 1
        candidate = name if counts[name] == 1 else f"{name}_{counts[name]}"
        if candidate not in used:
            used.add(candidate)
            return candidate
