"""Words in the names of joints: the side, and the part of the body that a name speaks of."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

TOKEN = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")
SIDES = {
    **dict.fromkeys(("left", "l", "lt", "lft"), "left"),
    **dict.fromkeys(("right", "r", "rt", "rgt"), "right"),
}
SIDE_WORD = re.compile(r"^(left|right)(.+)$|^(.+)(left|right)$")
REMARK = re.compile(r"\[.*?\]|\(.*?\)")
BEFORE = ("upper", "up", "lower", "low", "fore")
"""Words that stand before the limb, whichever order a name has."""
HELPERS = frozenset(
    "twist roll ik fk pole target ctrl control nub end eff effector tip share part adj sec muscle "
    "weapon prop attach socket share corrective helper dummy ref hipjoint locator marker mch org "
    "site aim volume jiggle slide".split()
)
"""Words of joints that no role has: their limb has another joint for it."""
DIGITS = frozenset(
    "finger fingers thumb index middle ring pinky little big small digit carpal metacarpal "
    "metacarpals".split()
)
"""Words of fingers and single toes."""
PREFIX_SHARE = 0.6
"""Share of the joints whose names begin with a word of the tool."""

LIMB_WORDS: dict[str, dict[str, float]] = {
    "Shoulder": {
        **dict.fromkeys(("clavicle", "collar", "collarbone"), 1.0),
        "scapula": 0.9,
        "shoulder": 0.8,
        "shldr": 0.6,
    },
    "UpperArm": {
        **dict.fromkeys(("upperarm", "uparm", "uarm", "humerus"), 1.0),
        "arm": 0.9,
        "shoulder": 0.7,
        "shldr": 0.75,
    },
    "LowerArm": dict.fromkeys(("lowerarm", "lowarm", "forearm", "farm", "radius", "elbow"), 1.0),
    "Hand": {"hand": 1.0, "wrist": 0.8, "palm": 0.8},
    "Fingers": {"hand": 0.2, "palm": 0.2},
    "UpperLeg": {
        **dict.fromkeys(("upperleg", "upleg", "uleg", "thigh", "femur"), 1.0),
        "hip": 0.7,
        "leg": 0.5,
    },
    "LowerLeg": {
        **dict.fromkeys(("lowerleg", "lowleg", "calf", "shin", "tibia", "knee"), 1.0),
        "leg": 0.9,
    },
    "Foot": {"foot": 1.0, "ankle": 0.9},
    "Toes": {**dict.fromkeys(("toes", "toe", "toebase", "ball"), 1.0), "foot": 0.4},
}
"""Scores of words that name the joint of a role, 0 to 1, by role without its side.

Fingers are no role: they tell whether a joint before them is the hand.
"""
HIPS = frozenset({"hips", "hip", "pelvis"})
TRUNK_WORDS = HIPS | {"neck", "head", "chest", "spine", "thorax", "ribcage", "root"}
KNOWN = TRUNK_WORDS | {word for words in LIMB_WORDS.values() for word in words}
LONGEST_NAME = 60
"""Letters of a name that are looked at."""


@dataclass(frozen=True)
class JointWord:
    """Meaning of a joint's name.

    side: "left", "right" or "". key: the words of the part of the body, joined. is_exact: whether
    the name has no other words. is_helper: whether it names a twist, a target, an end and the like.
    is_digit: whether it names a finger or a single toe.
    """

    side: str
    key: str
    is_exact: bool
    is_helper: bool
    is_digit: bool

    def score(self, role: str) -> float:
        """Return how well the name fits a role without its side, 0 to 1."""
        if self.is_helper:
            return 0.0
        if self.is_digit:
            return 0.3 if role == "Fingers" else 0.0
        if (role, self.key) == ("Toes", "foot") and not self.is_exact:
            return 0.0
        return LIMB_WORDS[role].get(self.key, 0.0) * (1.0 if self.is_exact else 0.85)


def joint_words(names: Sequence[str]) -> tuple[JointWord, ...]:
    """Return the meaning of each name; words with which most names begin or end are left out."""
    split = [_tokens(name) for name in names]
    for end in (0, -1):
        while (word := _common(split, end)) is not None:
            split = [_without(words, word, end) for words in split]
    return tuple(_word(words) for words in split)


def _without(words: list[str], word: str, end: int) -> list[str]:
    """Return words without a word at one end, 0 or -1, if it stands there and others remain."""
    if len(words) < 2 or words[end] != word:
        return words
    return words[1:] if end == 0 else words[:-1]


def _tokens(name: str) -> list[str]:
    """Return the words of a name in small letters, without numbers, name space and remarks.

    Single letters count where they tell the side.
    """
    whole = name.rpartition(":")[2][-LONGEST_NAME:]
    bare = REMARK.sub("", whole) or whole
    found: list[str] = []
    for token in TOKEN.findall(bare):
        word = token.lower()
        parts = SIDE_WORD.match(word)
        found += [part for part in parts.groups() if part] if parts else [word]
    return [word for word in found if word in SIDES or (len(word) > 1 and not word.isdigit())]


def _common(split: Sequence[Sequence[str]], end: int) -> str | None:
    """Return the word of a tool with which most names begin (0) or end (-1); None without one."""
    counts = Counter(words[end] for words in split if len(words) > 1)
    for word, count in counts.most_common(1):
        is_meaning = word in SIDES or word in KNOWN or word in BEFORE or word in DIGITS
        if count >= PREFIX_SHARE * len(split) and len(split) > 2 and not is_meaning:
            return word
    return None


def _word(words: Sequence[str]) -> JointWord:
    side, rest = _take_side(list(words))
    is_helper = not HELPERS.isdisjoint(rest)
    is_digit = not DIGITS.isdisjoint(rest)
    rest = sorted(rest, key=lambda word: word not in BEFORE)
    joined = "".join(rest)
    if joined in KNOWN:
        return JointWord(side, joined, True, is_helper, is_digit)
    parts = ["".join(rest[a:b]) for a in range(len(rest)) for b in range(a + 1, len(rest) + 1)]
    known = max((part for part in parts if part in KNOWN), key=len, default="")
    return JointWord(side, known or joined, not known, is_helper, is_digit)


def _take_side(words: list[str]) -> tuple[str, list[str]]:
    """Return the side of a name and its other words; a name is more than its side."""
    for index, word in enumerate(words):
        if word in SIDES and len(words) > 1:
            return SIDES[word], words[:index] + words[index + 1 :]
    joined = "".join(words)
    if joined not in KNOWN:
        for letter, rest in ((joined[:1], joined[1:]), (joined[-1:], joined[:-1])):
            if letter in ("l", "r") and _is_limb(rest):
                return SIDES[letter], [rest]
    return "", words


def _is_limb(word: str) -> bool:
    return word in KNOWN or word in HELPERS or word in DIGITS
