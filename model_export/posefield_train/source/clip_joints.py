"""Joints of clips: those that a recipe names, drops and keeps, and equal skeletons of all."""

from collections.abc import Collection, Sequence
from dataclasses import replace

from posefield.common.name_suggestion import did_you_mean
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.bvh import end_sites
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.recipe import Recipe


def drop_joints(clip: Clip, recipe: Recipe, row: ClipRow) -> Clip:
    """Return the clip without the dropped joints and their descendants.

    End sites that the recipe names are joints of the clip.
    """
    needed = named_joints(recipe)
    sites = [name for name in end_sites.end_site_names(clip.skeleton) if name]
    clip = end_sites.with_end_joints(clip, needed)
    joints = clip.skeleton
    missing = (needed | set(recipe.motion.drop_joints)) - set(joints.names)
    if missing:
        raise row.error(
            f"{row.place} has no joints {_missing_names(missing, (*joints.names, *sites))}"
        )
    dropped = {joints.names.index(name) for name in recipe.motion.drop_joints}
    for joint, parent in enumerate(joints.parents):
        if parent in dropped:
            dropped.add(joint)
    if 0 in dropped:
        raise row.error("the root cannot be dropped")
    kept = [joint for joint in range(len(joints)) if joint not in dropped]
    gone = needed - {joints.names[joint] for joint in kept}
    if gone:
        raise row.error(f"joints {sorted(gone)} are dropped, and named by the recipe elsewhere")
    return keep_joints(clip, kept)


MOST_LISTED = 60
"""Joints that a message lists."""


def _missing_names(missing: Collection[str], known: Sequence[str]) -> str:
    """Return names that the recipe has and a file lacks, with similar ones and all that it has."""
    told = ", ".join(f"{name!r}{did_you_mean(name, known)}" for name in sorted(missing))
    there = list(dict.fromkeys(known))
    more = f" and {len(there) - MOST_LISTED} more" if len(there) > MOST_LISTED else ""
    listed = ", ".join(there[:MOST_LISTED])
    return f"{told} that the recipe names, expected some of {listed}{more}"


def has_all_parents(joints: Skeleton, kept: Sequence[int]) -> bool:
    """Return True if the parent of every kept joint is kept too."""
    return all(joints.parents[joint] in kept or joints.parents[joint] < 0 for joint in kept)


def keep_joints(clip: Clip, kept: Sequence[int]) -> Clip:
    """Return the clip of some of its joints, in order; `kept` must be closed under parents."""
    joints = clip.skeleton
    tips = [i for i, joint in enumerate(joints.tip_joints) if joint in kept]
    smaller = Skeleton(
        tuple(joints.names[joint] for joint in kept),
        tuple(kept.index(joints.parents[j]) if j else -1 for j in kept),
        joints.offsets[kept],
        tuple(kept.index(joints.tip_joints[i]) for i in tips),
        joints.tip_offsets[tips],
    )
    rotations, translations = clip.rotations[:, kept], clip.translations[:, kept]
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


def expect_same_skeleton(rows: Sequence[ClipRow], clips: Sequence[Clip]) -> None:
    """Raise RecipeError for a row whose clip has other joints than the first row\'s."""
    first = clips[0].skeleton
    for row, clip in zip(rows, clips, strict=True):
        if not clip.skeleton.same_tree(first):
            raise row.error(
                f"{row.place} has other joints than {rows[0].place} of line "
                f"{rows[0].line}: {_difference(clip.skeleton, first)}; of people, say "
                "skeleton.topology = 'roles'"
            )


def _difference(a: Skeleton, b: Skeleton) -> str:
    if set(a.names) != set(b.names):
        return f"only one of them has {sorted(set(a.names) ^ set(b.names))}"
    return "the same names in another order or hierarchy"
