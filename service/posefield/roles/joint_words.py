"""Words in the names of joints: the side, and the part of the body that a name speaks of.

A name alone is ambiguous: a shoulder is the collar bone or the upper arm, a leg is the lower leg or
the whole. Along a limb the order decides.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
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
    text = name.rpartition(":")[2][-LONGEST_NAME:]
    bare = REMARK.sub("", text) or text
    tokens: list[str] = []
    for token in TOKEN.findall(bare):
        word = token.lower()
        match = SIDE_WORD.match(word)
        tokens += [piece for piece in match.groups() if piece] if match else [word]
    return [word for word in tokens if word in SIDES or (len(word) > 1 and not word.isdigit())]


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
    pieces = ["".join(rest[a:b]) for a in range(len(rest)) for b in range(a + 1, len(rest) + 1)]
    longest = max((piece for piece in pieces if piece in KNOWN), key=len, default="")
    return JointWord(side, longest or joined, not longest, is_helper, is_digit)


def _take_side(words: list[str]) -> tuple[str, list[str]]:
    """Return the side of a name and its other words; a name is more than its side."""
    for index, word in enumerate(words):
        if word in SIDES and len(words) > 1:
            return SIDES[word], words[:index] + words[index + 1 :]
    joined = "".join(words)
    if joined not in KNOWN:
        for letter, rest in ((joined[:1], joined[1:]), (joined[-1:], joined[:-1])):
            if letter in ("l", "r") and rest in KNOWN | HELPERS | DIGITS:
                return SIDES[letter], [rest]
    return "", words


ARM = ("Shoulder", "UpperArm", "LowerArm", "Hand", "Fingers")
LEG = ("UpperLeg", "LowerLeg", "Foot", "Toes")
NEEDED = frozenset({"UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot"})
"""Roles that every limb has; a limb without one costs LACK."""
LACK = 0.5
JOINT_WORDS = frozenset({"elbow", "knee"})
JOINT_NAMED = {("Hand", "wrist"): 1.2, ("Foot", "ankle"): 1.1}
"""Scores where joints bear the names of joints, not of bones: then the hand begins at the wrist.
Where they bear the names of bones, a wrist is a piece of the lower arm that twists."""
SURE, GAIN = 0.6, 1.5
"""Confidence of a joint without an alternative that is worse, and its gain by the difference."""

Scores = Sequence[Mapping[str, float]]


@dataclass(frozen=True)
class LimbJoint:
    """The joint of a role with its confidence, 0 to 1."""

    joint: int
    confidence: float


def align_limb(
    paths: Sequence[Sequence[int]], words: Sequence[JointWord], roles: Sequence[str]
) -> dict[str, LimbJoint]:
    """Return the joints of a limb by role without its side.

    paths: joints of one side from the root to each leaf. words: of all joints. The confidence
    follows from the score of the best alignment in which the role has another joint or none.
    """
    ways = dict.fromkeys(
        tuple(joint for joint in path if any(words[joint].score(role) for role in roles))
        for path in paths
    )
    scored = [(chain, _scores(chain, words, roles)) for chain in ways if chain]
    best: dict[str, int] = {}
    top = 0.0
    for chain, scores in scored:
        total, picks = _align(scores, roles)
        if total > top + 1e-9:
            top, best = total, {role: chain[at] for role, at in picks.items()}
    joints = {}
    for role, joint in best.items():
        second = max(
            _align(scores, roles, role, _pieces(chain, joint, words))[0] for chain, scores in scored
        )
        joints[role] = LimbJoint(joint, min(1.0, SURE + GAIN * (top - max(second, 0.0))))
    joints.pop("Fingers", None)
    return joints


def _pieces(chain: Sequence[int], joint: int, words: Sequence[JointWord]) -> frozenset[int]:
    """Return the indices in a way of a joint and of others of its name, such as the second half."""
    if joint not in chain:
        return frozenset()
    return frozenset(at for at, other in enumerate(chain) if words[other] == words[joint])


def _scores(chain: Sequence[int], words: Sequence[JointWord], roles: Sequence[str]) -> Scores:
    """Return the score of each role at each joint of a way."""
    by_joints = any(words[joint].key in JOINT_WORDS for joint in chain)
    scores = []
    for joint in chain:
        role_scores = {role: score for role in roles if (score := words[joint].score(role))}
        for role in role_scores:
            stated = JOINT_NAMED.get((role, words[joint].key))
            role_scores[role] = (
                stated if stated and by_joints and words[joint].is_exact else role_scores[role]
            )
        scores.append(role_scores)
    return scores


def _align(
    scores: Scores, roles: Sequence[str], avoided: str = "", forbidden: frozenset[int] = frozenset()
) -> tuple[float, dict[str, int]]:
    """Return the best total score and the index of the joint of each role, in the joints' order.

    forbidden: indices of joints that may not have the role `avoided`. Of equal scores the joint
    nearest to the root is taken.
    """
    # totals[i]: best total of the roles so far with joints before i, and its choice.
    totals: list[tuple[float, dict[str, int]]] = [(0.0, {})] * (len(scores) + 1)
    for role in roles:
        lack = LACK if role in NEEDED else 0.0
        following = [(totals[0][0] - lack, totals[0][1])]
        for at, joint_scores in enumerate(scores):
            skipped = (totals[at + 1][0] - lack, totals[at + 1][1])
            choice = max(following[-1], skipped, key=lambda total_and_choice: total_and_choice[0])
            if role in joint_scores and not (role == avoided and at in forbidden):
                total = totals[at][0] + joint_scores[role]
                if total > choice[0] + 1e-9:
                    choice = (total, totals[at][1] | {role: at})
            following.append(choice)
        totals = following
    return totals[-1]
