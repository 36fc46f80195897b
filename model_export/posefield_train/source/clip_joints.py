"""Joints of clips: those that a recipe names, drops and keeps, end sites, and lengths of bones."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from posefield.common.errors import did_you_mean
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.recipe import Recipe

MAX_LISTED = 60
"""Joints that a message lists."""


def drop_joints(clip: Clip, recipe: Recipe, row: ClipRow) -> Clip:
    """Return the clip without the dropped joints and their descendants.

    End sites that the recipe names are joints of the clip.
    """
    needed = named_joints(recipe)
    sites = [name for name in end_site_names(clip.skeleton) if name]
    clip = with_end_joints(clip, needed)
    joints = clip.skeleton
    missing = (needed | set(recipe.motion.drop_joints)) - set(joints.names)
    if missing:
        candidates = list(dict.fromkeys((*joints.names, *sites)))
        listed = ", ".join(f"{name!r}{did_you_mean(name, candidates)}" for name in sorted(missing))
        more = f" and {len(candidates) - MAX_LISTED} more" if len(candidates) > MAX_LISTED else ""
        raise row.error(
            f"{row.file} has no joints {listed} that the recipe names, expected some of "
            f"{', '.join(candidates[:MAX_LISTED])}{more}"
        )
    dropped = {joints.names.index(name) for name in recipe.motion.drop_joints}
    for joint, parent in enumerate(joints.parents):
        if parent in dropped:
            dropped.add(joint)
    if 0 in dropped:
        raise row.error("the root cannot be dropped")
    indices = [joint for joint in range(len(joints)) if joint not in dropped]
    gone = needed - {joints.names[joint] for joint in indices}
    if gone:
        raise row.error(f"joints {sorted(gone)} are dropped, and named by the recipe elsewhere")
    return keep_joints(clip, indices)


def keep_joints(clip: Clip, indices: Sequence[int]) -> Clip:
    """Return the clip of some of its joints, each with its parent before it in `indices`."""
    joints = clip.skeleton
    tips = [i for i, joint in enumerate(joints.tip_joints) if joint in indices]
    smaller = Skeleton(
        tuple(joints.names[joint] for joint in indices),
        tuple(indices.index(joints.parents[j]) if j else -1 for j in indices),
        joints.offsets[indices],
        tuple(indices.index(joints.tip_joints[i]) for i in tips),
        joints.tip_offsets[tips],
    )
    rotations, translations = clip.rotations[:, indices], clip.translations[:, indices]
    return replace(clip, skeleton=smaller, rotations=rotations, translations=translations)


def named_joints(recipe: Recipe) -> set[str]:
    """Return the joints that a recipe names."""
    event = {recipe.event.joint} if recipe.event else set()
    motion = recipe.motion
    autos = [control.auto for control in recipe.measured]
    event |= {joint for auto in autos for joint in (*auto.joint_names, *recipe.leg_ends(auto))}
    listed = {
        *motion.joint_weights,
        *motion.feet,
        *recipe.contacts.columns,
        *motion.end_sites,
        *recipe.roles.values(),
    }
    return listed | event


def in_common_order(rows: Sequence[ClipRow], clips: Sequence[Clip]) -> tuple[list[Clip], list[str]]:
    """Return the clips with the joints in the order of the first one, and notes.

    Joints are matched by their names. End sites that not all clips have are left out. Raises
    RecipeError for a row whose clip has other joints than the first row's, or other parents.
    """
    first = clips[0].skeleton
    ordered = [ordered_as(clip, first.names) for clip in clips]
    for row, clip, same in zip(rows, clips, ordered, strict=True):
        if same is None or not same.skeleton.same_tree(first):
            only = sorted(set(clip.skeleton.names) ^ set(first.names))
            difference = "the same names with other parents"
            if only:
                difference = f"only one of them has {only}"
            raise row.error(
                f"{row.file} has other joints than {rows[0].file} of line {rows[0].line}: "
                f"{difference}; of people, say skeleton.topology = 'roles'"
            )
    return _with_common_sites([clip for clip in ordered if clip is not None])


def ordered_as(clip: Clip, names: Sequence[str]) -> Clip | None:
    """Return the clip of the named joints alone, in their order.

    None for a clip that lacks one of them or its parent, or has a parent after its child.
    """
    joints = clip.skeleton
    if joints.names == tuple(names):
        return clip
    if not set(names) <= set(joints.names):
        return None
    indices = [joints.names.index(name) for name in names]
    is_tree = all(
        joints.parents[j] in indices[:at] or joints.parents[j] < 0 for at, j in enumerate(indices)
    )
    return keep_joints(clip, indices) if is_tree and indices[0] == 0 else None


def _with_common_sites(clips: Sequence[Clip]) -> tuple[list[Clip], list[str]]:
    """Return the clips of one tree with the end sites that all of them have, and a note."""
    sites = [end_site_names(clip.skeleton) for clip in clips]
    common = [name for name in sites[0] if name and all(name in site_names for site_names in sites)]
    trimmed = []
    for clip, names in zip(clips, sites, strict=True):
        joints, indices = clip.skeleton, [names.index(name) for name in common]
        tips = tuple(joints.tip_joints[at] for at in indices)
        skeleton = replace(joints, tip_joints=tips, tip_offsets=joints.tip_offsets[indices])
        trimmed.append(replace(clip, skeleton=skeleton))
    lost = sorted({name for names in sites for name in names} - {*common, ""})
    sentence = (
        f"{', '.join(lost[:MAX_LISTED])}: left out, since not all {len(clips)} clips have them"
    )
    return trimmed, [f"end sites {sentence}"] if lost else []


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


def with_end_joints(clip: Clip, requested: Collection[str]) -> Clip:
    """Return the clip with joints, each after its parent, in place of the end sites of some names.

    The joints never turn and keep their distance from their parents.
    """
    joints, names = clip.skeleton, end_site_names(clip.skeleton)
    chosen = [site for site, name in enumerate(names) if name and name in requested]
    if not chosen:
        return clip
    count = len(joints)
    parents = [joints.tip_joints[site] for site in chosen]
    # The end joints follow their parents, so that joints stay in depth-first order.
    order = sorted(
        range(count + len(chosen)),
        key=lambda joint: (joint, 0) if joint < count else (parents[joint - count], joint),
    )
    new_index = {joint: index for index, joint in enumerate(order)}
    above = [*joints.parents, *parents]
    remaining = [site for site in range(len(names)) if site not in chosen]
    tips = joints.tip_offsets[chosen]
    longer = Skeleton(
        tuple([*joints.names, *(names[site] for site in chosen)][joint] for joint in order),
        tuple(new_index[above[joint]] if joint else -1 for joint in order),
        np.concatenate([joints.offsets, tips])[order],
        tuple(new_index[joints.tip_joints[site]] for site in remaining),
        joints.tip_offsets[remaining],
    )
    still = np.tile(quat.IDENTITY, (len(clip), len(chosen), 1))
    tip_translations = np.broadcast_to(tips, (len(clip), *tips.shape))
    return replace(
        clip,
        skeleton=longer,
        rotations=np.concatenate([clip.rotations, still], axis=1)[:, order],
        translations=np.concatenate([clip.translations, tip_translations], axis=1)[:, order],
    )


# Adults differ by less than this factor in size.
SIZE_LIMIT = 1.5
# Names of the units that files use, and their length in metres.
UNITS = {
    "millimetres": 0.001,
    "centimetres": 0.01,
    "inches": 0.0254,
    "ASF units": 0.0564444,
    "decimetres": 0.1,
    "feet": 0.3048,
    "metres": 1.0,
}
# Largest ratio between the factor found and a unit's factor.
UNIT_TOLERANCE = 1.15
# Bones of one performer differ by less than SAME, m, between clips, and from those of another
# performer by more than CLEAR times that spread.
SAME, CLEAR = 0.002, 3.0


@dataclass(frozen=True)
class ForeignBones:
    """A clip whose bones differ from those of its performer's other clips.

    distance: root mean square, m. clips: number of the performer's other clips. nearest_performer:
    another one with matching bones, or "". nearest_distance: from that performer's bones, m.
    """

    distance: float
    clips: int
    nearest_performer: str
    nearest_distance: float


def relative_sizes(offsets: Floats) -> Floats:
    """Return the total bone length (N,) of offsets (N, J, 3) relative to the family's median.

    A single joint has no bones: its clips are alike.
    """
    lengths = np.linalg.norm(offsets, axis=-1).sum(axis=-1)
    median = np.median(lengths)
    return np.asarray(lengths / median) if median > 0.0 else np.ones(len(lengths))


def guess_unit(metres_per_unit: float, size: float) -> str:
    """Return the unit of a file whose skeleton is `size` times too large; "" if none fits."""
    fits = {name: abs(np.log(metres_per_unit / size / m)) for name, m in UNITS.items()}
    name = min(fits, key=lambda name: fits[name])
    return name if fits[name] < np.log(UNIT_TOLERANCE) else ""


def find_foreign_bones(
    offsets: Floats, performers: tuple[str, ...], clip: int
) -> ForeignBones | None:
    """Return how a clip's bones (N, J, 3) differ from its performer's; None if they match.

    If a performer has only two clips and they differ, neither is reported unless it matches another
    performer's bones.
    """
    whose = np.array(performers)
    siblings = np.flatnonzero((whose == whose[clip]) & (np.arange(len(whose)) != clip))
    if not whose[clip] or not len(siblings):
        return None
    median = np.median(offsets[siblings], axis=0)
    gap = apart(offsets[clip], median)
    spread = float(np.median([apart(one, median) for one in offsets[siblings]]))
    if gap < max(SAME, CLEAR * spread):
        return None
    near = _nearest(offsets, whose, clip)
    if near[0] < gap / CLEAR:
        return ForeignBones(gap, len(siblings), near[1], near[0])
    return ForeignBones(gap, len(siblings), "", 0.0) if len(siblings) > 1 else None


def _nearest(offsets: Floats, whose: npt.NDArray[np.str_], clip: int) -> tuple[float, str]:
    """Return the distance, m, and name of the other performer with the most similar bones."""
    names = sorted(set(whose.tolist()) - {whose[clip], ""})
    means = [np.median(offsets[whose == name], axis=0) for name in names]
    gaps = [(apart(offsets[clip], mean), name) for mean, name in zip(means, names, strict=True)]
    return min(gaps, default=(np.inf, ""))


def apart(a: Floats, b: Floats) -> float:
    """Return the root mean square distance of points (..., 3)."""
    return float(np.sqrt(np.mean(np.sum(np.square(a - b), axis=-1))))
