"""Knees and elbows of captured clips: their axes and the ranges of their angles."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from posefield.motion import hinges, skeleton
from posefield.motion.hinges import Hinge
from posefield_train.source.ingest import Example

LIMB_ENDS = {"LowerLeg": "Foot", "LowerArm": "Hand"}
"""Role of the end of a limb by that of its hinge, both without their side."""


def measure_hinges(examples: Sequence[Example], roles: Mapping[str, str]) -> tuple[Hinge, ...]:
    """Return the hinges of knees and elbows that bend in the clips, sorted by joint.

    roles: joint by role; limbs without roles of their hinge and end have none.
    """
    tree = examples[0].clip.skeleton
    found = []
    for side in ("left", "right"):
        for hinge, end in LIMB_ENDS.items():
            if side + hinge in roles and side + end in roles:
                joint, tip = (tree.names.index(roles[side + role]) for role in (hinge, end))
                found.append(_measure(examples, joint, _next_joint(tree.parents, joint, tip)))
    return tuple(sorted(filter(None, found), key=lambda hinge: hinge.joint))


def widened(known: Sequence[Hinge], examples: Sequence[Example]) -> tuple[Hinge, ...]:
    """Return hinges whose ranges include the angles of further clips."""
    if not known:
        return ()
    rotations = np.concatenate([example.clip.rotations for example in examples])
    angles = hinges.from_card(tuple(known)).angles(rotations)
    lows, highs = angles.min(axis=0), angles.max(axis=0)
    return tuple(
        replace(
            hinge,
            low=hinges.rounded(np.minimum(hinge.low, low)),
            high=hinges.rounded(np.maximum(hinge.high, high)),
        )
        for hinge, low, high in zip(known, lows, highs, strict=True)
    )


def _next_joint(parents: tuple[int, ...], joint: int, tip: int) -> int | None:
    """Return the child of a joint that leads to a tip; None if the tip is not below it."""
    chain = list(skeleton.joint_chain(parents, tip))
    return chain[chain.index(joint) + 1] if joint in chain[:-1] else None


def _measure(examples: Sequence[Example], joint: int, child: int | None) -> Hinge | None:
    if child is None:
        return None
    counts = [len(example.clip.rotations) for example in examples]
    rotations = np.concatenate([example.clip.rotations[:, joint] for example in examples])
    bones = np.array([example.offsets[[joint, child]] for example in examples])
    above, below = np.repeat(bones, counts, axis=0).swapaxes(0, 1)
    return hinges.measure(joint, rotations, above, below)
