"""Alignment of the joints of a limb with its roles, by their names and their order.

A name alone is ambiguous: a shoulder is the collar bone or the upper arm, a leg is the lower leg or
the whole. Along a limb the order decides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from posefield.roles.joint_words import JointWord

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
    ways = list(dict.fromkeys(tuple(_named(path, words, roles)) for path in paths))
    scored = [(way, _scores(way, words, roles)) for way in ways if way]
    best: dict[str, int] = {}
    top = 0.0
    for way, scores in scored:
        total, picks = _align(scores, roles)
        if total > top + 1e-9:
            top, best = total, {role: way[at] for role, at in picks.items()}
    found = {}
    for role, joint in best.items():
        second = max(
            _align(scores, roles, role, _pieces(way, joint, words))[0] for way, scores in scored
        )
        found[role] = LimbJoint(joint, min(1.0, SURE + GAIN * (top - max(second, 0.0))))
    found.pop("Fingers", None)
    return found


def _pieces(way: Sequence[int], joint: int, words: Sequence[JointWord]) -> frozenset[int]:
    """Return the indices in a way of a joint and of others of its name, such as the second half."""
    if joint not in way:
        return frozenset()
    return frozenset(at for at, other in enumerate(way) if words[other] == words[joint])


def _named(path: Sequence[int], words: Sequence[JointWord], roles: Sequence[str]) -> list[int]:
    return [joint for joint in path if any(words[joint].score(role) for role in roles)]


def _scores(way: Sequence[int], words: Sequence[JointWord], roles: Sequence[str]) -> Scores:
    """Return the score of each role at each joint of a way."""
    by_joints = any(words[joint].key in JOINT_WORDS for joint in way)
    found = []
    for joint in way:
        own = {role: score for role in roles if (score := words[joint].score(role))}
        for role in own:
            named = JOINT_NAMED.get((role, words[joint].key))
            own[role] = named if named and by_joints and words[joint].is_exact else own[role]
        found.append(own)
    return found


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
        for at, own in enumerate(scores):
            skipped = (totals[at + 1][0] - lack, totals[at + 1][1])
            choice = max(following[-1], skipped, key=lambda one: one[0])
            if role in own and not (role == avoided and at in forbidden):
                total = totals[at][0] + own[role]
                if total > choice[0] + 1e-9:
                    choice = (total, totals[at][1] | {role: at})
            following.append(choice)
        totals = following
    return totals[-1]
