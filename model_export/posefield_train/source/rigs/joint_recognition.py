"""Roles of joints by their names, in the conventions of common tools."""

import re
from collections.abc import Mapping, Sequence

PREFIX = re.compile(r"^(.*:|bip0*1?[ _]|valvebiped[._]|joint[_ ]?)", re.IGNORECASE)
"""Beginning that a tool puts before the names of all joints."""
SIDE_WORDS = re.compile(r"(?P<left>left)|(?P<right>right)")
SIDE_ENDS = re.compile(r"^(?P<name>.*?)[_. -](?P<side>[lr])$")
SIDE_BEGINS = re.compile(r"^(?P<side>[lr])[_. -]?(?P<name>.*)$")

LIMBS = {
    "Shoulder": ("shoulder", "clavicle", "collar"),
    "UpperArm": ("arm", "upperarm", "uparm", "humerus"),
    "LowerArm": ("forearm", "lowerarm", "lowarm", "radius", "elbow"),
    "Hand": ("hand", "wrist"),
    "UpperLeg": ("upleg", "upperleg", "thigh", "femur"),
    "LowerLeg": ("leg", "lowerleg", "lowleg", "calf", "shin", "tibia", "knee"),
    "Foot": ("foot", "ankle"),
    "Toes": ("toes", "toe", "toebase", "ball"),
}
"""Names of the joints of a limb without their side, by role; the first that a file has counts."""
TRUNK = {
    "hips": ("hips", "hip", "pelvis", "root"),
    "neck": ("neck", "lowerneck", "neck1"),
    "head": ("head",),
}


def roles_of(names: Sequence[str], parents: Sequence[int]) -> dict[str, str]:
    """Return the joints that have a role, by role.

    names, parents: of the joints; the parent of the root is -1. Joints of the trunk between hips
    and neck have their role by their place in the chain.
    """
    plain = {name: _plain(name) for name in names}
    found: dict[str, str] = {}
    for role, words in TRUNK.items():
        _assign(found, role, ("", words), plain)
    found.update(_spine(names, parents, found))
    for side in ("left", "right"):
        for role, words in LIMBS.items():
            _assign(found, side + role, (side, words), plain)
    return found


def _assign(
    found: dict[str, str],
    role: str,
    wanted: tuple[str, Sequence[str]],
    plain: Mapping[str, tuple[str, str]],
) -> None:
    """Give a role to the first free joint with a wanted side and one of the wanted words."""
    side, words = wanted
    for word in words:
        for name, own in plain.items():
            if own == (side, word) and name not in found.values():
                found[role] = name
                return


def _plain(name: str) -> tuple[str, str]:
    """Return the side of a joint, "left", "right" or "", and its name without side and prefix."""
    bare = PREFIX.sub("", name).lower()
    if word := SIDE_WORDS.search(bare):
        return str(word.lastgroup), _letters(bare[: word.start()] + bare[word.end() :])
    sides = {"l": "left", "r": "right"}
    if end := SIDE_ENDS.match(bare):
        return sides[end["side"]], _letters(end["name"])
    known = {word for words in LIMBS.values() for word in words}
    begin = SIDE_BEGINS.match(bare)
    if begin and _letters(begin["name"]) in known:
        return sides[begin["side"]], _letters(begin["name"])
    return "", _letters(bare)


def _letters(name: str) -> str:
    return re.sub(r"[_. -]", "", name)


def _spine(
    names: Sequence[str], parents: Sequence[int], found: Mapping[str, str]
) -> dict[str, str]:
    """Return the roles of the joints between hips and neck: spine, chest and upperChest."""
    if not {"hips", "neck"} <= found.keys():
        return {}
    chain = []
    joint = parents[names.index(found["neck"])]
    while joint >= 0 and names[joint] != found["hips"]:
        chain.append(names[joint])
        joint = parents[joint]
    if joint < 0:
        return {}
    chain.reverse()
    picked = chain if len(chain) < 3 else [chain[0], chain[-2], chain[-1]]
    return dict(zip(("spine", "chest", "upperChest"), picked, strict=False))
