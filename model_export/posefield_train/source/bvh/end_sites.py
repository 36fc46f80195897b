"""End sites as joints: points beyond the last joint of a chain, such as a toe's tip or a paw."""

from collections import Counter
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

ENDING = "_end"
"""Ending of the name of an end site; motion files do not name them."""


def end_site_names(joints: Skeleton) -> list[str]:
    """Return a name for each end site: its joint's with the ending _end, then _end_2 and so on.

    A name that a joint has is not given to an end site; it is empty instead.
    """
    counts: Counter[int] = Counter()
    names = []
    for joint in joints.tip_joints:
        counts[joint] += 1
        number = f"_{counts[joint]}" if counts[joint] > 1 else ""
        name = f"{joints.names[joint]}{ENDING}{number}"
        names.append("" if name in joints.names else name)
    return names


def with_end_joints(clip: Clip, wanted: Collection[str]) -> Clip:
    """Return the clip with joints, each after its parent, in place of the end sites of some names.

    The joints never turn and keep their distance from their parents.
    """
    joints, names = clip.skeleton, end_site_names(clip.skeleton)
    chosen = [site for site, name in enumerate(names) if name and name in wanted]
    if not chosen:
        return clip
    count = len(joints)
    parents = [joints.tip_joints[site] for site in chosen]
    # The end joints follow their parents, so that joints stay in depth-first order.
    order = sorted(
        range(count + len(chosen)),
        key=lambda joint: (joint, 0) if joint < count else (parents[joint - count], joint),
    )
    place = {joint: index for index, joint in enumerate(order)}
    above = [*joints.parents, *parents]
    kept = [site for site in range(len(names)) if site not in chosen]
    tips = joints.tip_offsets[chosen]
    longer = Skeleton(
        tuple([*joints.names, *(names[site] for site in chosen)][joint] for joint in order),
        tuple(place[above[joint]] if joint else -1 for joint in order),
        np.concatenate([joints.offsets, tips])[order],
        tuple(place[joints.tip_joints[site]] for site in kept),
        joints.tip_offsets[kept],
    )
    still = np.tile(quat.IDENTITY, (len(clip), len(chosen), 1))
    moved = np.broadcast_to(tips, (len(clip), *tips.shape))
    return replace(
        clip,
        skeleton=longer,
        rotations=np.concatenate([clip.rotations, still], axis=1)[:, order],
        translations=np.concatenate([clip.translations, moved], axis=1)[:, order],
    )
