"""Clips from rows of the table: cut, in metres, Y up, with heading and origin removed."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from posefield.common.array_shapes import Positions
from posefield.common.name_suggestion import did_you_mean
from posefield.common.units import UP, Floats
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import (
    bvh,
    clip_notes,
    clip_table,
    curve_files,
    half_turns,
    measured_controls,
    shipped_recipes,
)
from posefield_train.source.bvh import end_sites
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.curve_files import CurveReader
from posefield_train.source.cycles import cycle_closing
from posefield_train.source.half_turns import Finding
from posefield_train.source.recipe import Recipe, Source
from posefield_train.source.rigs import rig_normalization
from posefield_train.source.rigs.rig_normalization import RigError, RiggedClips, RigSettings
from posefield_train.source.takes import take_groups

# Limit of frames times joints of all files of a training: two hours of 31 joints at 120 frames a
# second, which take 2.4 GB.
MAX_POSES = 30_000_000


@dataclass(frozen=True)
class Example:
    """A clip with its controls.

    controls: (d,), from the table and measured, in the recipe's order. landmarks: fractions of the
    clip, in order. jumps: removed jumps of small joints between two frames. shift: share of a cycle
    by which the clip was shifted to begin later. take: name of the take; examples of one take are
    left out together. facing: degrees from the root's +z to the body's facing in the file, to the
    left; None for a motion without a facing. captured: the clip of a cycle before its seam
    was closed; None where nothing was closed.
    """

    row: ClipRow
    clip: Clip
    controls: Floats
    landmarks: tuple[float, ...]
    jumps: tuple[Finding, ...]
    shift: float = 0.0
    take: str = ""
    facing: float | None = 0.0
    captured: Clip | None = None

    @property
    def offsets(self) -> Floats:
        """Return the bone offsets (J, 3), m, of the performer, zero for the root."""
        return measured_controls.bone_offsets(self.clip)


def ingest(recipe: Recipe, folder: Path) -> tuple[list[Example], list[str]]:
    """Return the examples of a recipe, and notes on assumptions and corrections.

    Raises RecipeError for an invalid row, BvhError for a file that cannot be read.
    """
    rows = clip_table.read(recipe, folder)
    alone = recipe.curves is not None and recipe.curves.alone
    files = {} if alone else read_files(rows)
    curves = curve_files.reader(recipe.curves, rows) if recipe.curves else None
    cuts = [_cut(recipe, _whole_clip(recipe, files, curves, row), row) for row in rows]
    _expect_same_skeleton(rows, [clip for clip, _ in cuts])
    rigged = _normalize_rigs(recipe, rows, [clip for clip, _ in cuts])
    found = [
        _example(recipe, row, clip, last, rigged.facing)
        for row, clip, (_, last) in zip(rows, rigged.clips, cuts, strict=True)
    ]
    examples = [own.example for own in found]
    _expect_same_order(recipe, examples)
    notes = shipped_recipes.table_notes(rows[0].table)
    if recipe.source.root_offset is None:
        notes += clip_notes.offset_notes(files)
    notes += [*rigged.notes, *clip_notes.stretch_notes(rows, [own.stretch for own in found])]
    takes, said = _takes(rows, found)
    examples = [replace(own, take=take) for own, take in zip(examples, takes, strict=True)]
    return examples, [*said, *notes]


def _takes(
    rows: Sequence[ClipRow], found: "Sequence[_FoundExample]"
) -> tuple[list[str], list[str]]:
    """Return the take of each row, stated or found, and notes on those that were found."""
    stated = clip_table.stated_takes(rows)
    if stated is not None:
        return stated, []
    return take_groups.find_takes(
        [str(row.place) for row in rows],
        [row.named for row in rows],
        [own.positions for own in found],
        found[0].example.clip.skeleton.names,
    )


def read_files(rows: Sequence[ClipRow]) -> dict[str, bvh.BvhFile]:
    """Return the motion files of rows by their places, each read once.

    Raises BvhError for a file that cannot be read and RecipeError for more than MOST_POSES in all.
    """
    files: dict[str, bvh.BvhFile] = {}
    poses = 0
    for row in rows:
        key = str(row.place)
        if key not in files:
            files[key] = bvh.read(row.place)
            poses += len(files[key].values) * len(files[key].joints)
        if poses > MAX_POSES:
            raise row.error(
                f"found {poses} poses of a joint in the files up to {row.place}, expected at most "
                f"{MAX_POSES}"
            )
    return files


@dataclass(frozen=True)
class _FoundExample:
    """An example before its take is known.

    stretch: largest change of a bone's length in it, m. positions: of its joints as captured
    (F, J, 3), m.
    """

    example: Example
    stretch: float
    positions: Positions


def _whole_clip(
    recipe: Recipe, files: Mapping[str, bvh.BvhFile], curves: CurveReader | None, row: ClipRow
) -> Clip:
    """Return the clip of all frames of a row's file, with its curves."""
    values = curves.read(row.curve_file) if curves else None
    if values and recipe.curves and recipe.curves.rate:
        return curve_files.resting_clip(values, recipe.curves.rate)
    clip = clip_of_file(files[str(row.place)], recipe.source)
    return curve_files.with_curves(clip, values, row) if values else clip


def _cut(recipe: Recipe, whole: Clip, row: ClipRow) -> tuple[Clip, int]:
    """Return the clip of a row without dropped joints, and the index of its last frame."""
    own, last = cut_frames(whole, row)
    return _drop_joints(own, recipe, row), last


def _normalize_rigs(recipe: Recipe, rows: Sequence[ClipRow], clips: Sequence[Clip]) -> RiggedClips:
    """Return the clips with normalized skeletons; RecipeError names the row at fault."""
    motion = recipe.motion
    roles = {str(role): joint for role, joint in recipe.roles.items()}
    named = frozenset(_named_joints(recipe))
    directions = {"left", "forward", "step_length"}
    directed = any(control.auto.quantity in directions for control in recipe.measured)
    settings = RigSettings(
        motion.facing, motion.bones == "stretch", motion.cyclic, directed, roles, named
    )
    performers = [row.performer for row in rows]
    try:
        return rig_normalization.normalize(
            clips, performers, [row.place.name for row in rows], settings
        )
    except RigError as fault:
        row = rows[fault.clip]
        raise row.error(f"{row.place}: {fault}") from fault


def _example(
    recipe: Recipe, row: ClipRow, captured: Clip, last: int, facing: float | None
) -> _FoundExample:
    """Return the example of a row."""
    motion, has_facing = recipe.motion, facing is not None
    in_place = motion.root == "in_place"
    before = captured_cycle(captured, in_place, has_facing) if motion.cyclic else None
    clip, jumps, stretch = canonicalize(captured, motion.cyclic, in_place, has_facing)
    marks = (*landmarks(row, last, recipe.clips.landmarks), *_found_landmark(recipe, row, clip))
    values = measured_controls.control_values(recipe, row, clip, marks)
    example = Example(row, clip, values, marks, jumps, facing=facing, captured=before)
    return _FoundExample(example, stretch, captured.positions())


def clip_of_file(file: bvh.BvhFile, source: Source) -> Clip:
    """Return the clip of all frames of a file.

    By default position channels replace the root's OFFSET.
    """
    return bvh.to_clip(
        file,
        metres_per_unit=source.metres_per_unit,
        up=source.up,
        root_offset=source.root_offset or "replace",
    )


def cut_frames(clip: Clip, row: ClipRow) -> tuple[Clip, int]:
    """Return the frames that a row names, and the index of the last of them in the file.

    Raises RecipeError for a frame that the file lacks, and for a single frame.
    """
    last = len(clip) - 1 if row.last_frame is None else row.last_frame
    if last >= len(clip):
        raise row.error(f"frame {last}, but {row.place} has frames 0 to {len(clip) - 1}")
    if last <= row.first_frame:
        raise row.error(f"{row.place} has frames 0 to {last}, expected two or more")
    kept = slice(row.first_frame, last + 1)
    rotations, translations = clip.rotations[kept], clip.translations[kept]
    curves = clip.curves and replace(clip.curves, values=clip.curves.values[kept])
    return replace(clip, rotations=rotations, translations=translations, curves=curves), last


def canonicalize(
    clip: Clip, cyclic: bool, in_place: bool, has_facing: bool = True
) -> tuple[Clip, tuple[Finding, ...], float]:
    """Return the clip with heading and origin removed, the corrections, and the stretch of bones.

    A cycle is closed. A motion without a facing keeps its heading. The stretch is the largest
    change of a component of a bone's offset, m.
    """
    stretch = float(np.ptp(clip.translations[:, 1:], axis=0).max(initial=0.0))
    # Before the cycle is closed, because closing it would spread a jump over all frames.
    clip, jumps = half_turns.remove_jumps(clip, 0)
    clip = _from_origin(clip, cyclic, has_facing)
    clip = cycle_closing.close_cycle(clip, heading(clip)) if cyclic else clip
    return remove_drift(clip) if in_place else clip, tuple(jumps), stretch


def _from_origin(clip: Clip, cyclic: bool, has_facing: bool) -> Clip:
    if not has_facing:
        return place(clip, _horizontal(clip.root_path[0]), np.zeros(()))
    return straighten_gait(clip) if cyclic else _start_at_origin(clip)


def captured_cycle(clip: Clip, in_place: bool, has_facing: bool = True) -> Clip:
    """Return a cycle with heading and origin removed as by `canonicalize`, its seam left open."""
    clip = _from_origin(half_turns.remove_jumps(clip, 0)[0], True, has_facing)
    return remove_drift(clip) if in_place else clip


def _drop_joints(clip: Clip, recipe: Recipe, row: ClipRow) -> Clip:
    """Return the clip without the dropped joints and their descendants.

    End sites that the recipe names are joints of the clip.
    """
    needed = _named_joints(recipe)
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


def _named_joints(recipe: Recipe) -> set[str]:
    """Return the joints that a recipe names."""
    event = {recipe.event.joint} if recipe.event else set()
    motion = recipe.motion
    autos = [control.auto for control in recipe.measured]
    event |= {joint for auto in autos for joint in (*auto.joint_names, *recipe.leg_ends(auto))}
    listed = {*motion.joint_weights, *motion.feet, *motion.end_sites, *recipe.roles.values()}
    return listed | event


def landmarks(row: ClipRow, last: int, columns: Sequence[str]) -> tuple[float, ...]:
    """Return the landmarks of a row as fractions of its clip.

    last: its last frame in the file. columns: of the landmarks. Raises RecipeError for a landmark
    out of the clip, and for two that do not rise.
    """
    named = [*zip(columns, row.landmarks, strict=True)]
    for column, frame in named:
        if not row.first_frame < frame < last:
            raise row.error(
                f"column {column!r}: frame {frame} is out of the clip, expected one between its "
                f"frames {row.first_frame} and {last} of {row.place.name}, without these two"
            )
    for (before, earlier), (column, later) in pairwise(named):
        if later <= earlier:
            raise row.error(
                f"column {column!r}: frame {later}, expected one after frame {earlier} of column "
                f"{before!r}, as in clips.landmarks"
            )
    return tuple((frame - row.first_frame) / (last - row.first_frame) for frame in row.landmarks)


def _found_landmark(recipe: Recipe, row: ClipRow, clip: Clip) -> tuple[float, ...]:
    """Return the moment of the recipe's event as a share of the clip, if it is found there."""
    if recipe.event is None or not recipe.event.is_found:
        return ()
    joint = clip.skeleton.names.index(recipe.event.joint)
    share = measured_controls.moment_share(clip, joint, recipe.event.at)
    return (event_landmark(row, recipe.event.joint, recipe.event.at, share),)


def event_landmark(row: ClipRow, joint: str, at: str, share: float) -> float:
    """Return the share of the clip of a row at which its event is.

    Raises RecipeError for an end of the clip, which alignment cannot move.
    """
    if 0.0 < share < 1.0:
        return share
    end = "start" if share == 0.0 else "end"
    raise row.error(
        f"{joint} is {at} at the {end} of {row.place.name}, expected a moment within the clip: cut "
        f"it longer, set event.at to '{end}', or name a column of clips.landmarks"
    )


def _expect_same_order(recipe: Recipe, examples: Sequence[Example]) -> None:
    """Raise RecipeError for a clip whose event lies between other landmarks than elsewhere."""
    names, first = recipe.landmark_names, examples[0]
    for example in examples:
        marks = example.landmarks
        order = np.argsort(marks).tolist()
        if order != np.argsort(first.landmarks).tolist() or len(set(marks)) < len(marks):
            found = ", ".join(f"{names[mark]} at {marks[mark]:.0%}" for mark in order)
            raise example.row.error(
                f"found {found} of {example.row.place.name}, expected the order of line "
                f"{first.row.line}, {', '.join(names[i] for i in np.argsort(first.landmarks))}"
            )


def _expect_same_skeleton(rows: Sequence[ClipRow], clips: Sequence[Clip]) -> None:
    first = clips[0].skeleton
    for row, clip in zip(rows, clips, strict=True):
        if not clip.skeleton.same_tree(first):
            raise row.error(
                f"{row.place} has other joints than {rows[0].place} of line "
                f"{rows[0].line}: {_difference(clip.skeleton, first)}"
            )


def _difference(a: Skeleton, b: Skeleton) -> str:
    if set(a.names) != set(b.names):
        return f"only one of them has {sorted(set(a.names) ^ set(b.names))}"
    return "the same names in another order or hierarchy"


def place(clip: Clip, origin: Floats, heading: Floats) -> Clip:
    """Return the clip with origin (…, 3) subtracted from its root, turned by -heading (…), rad."""
    turn = np.broadcast_to(quat.from_axis_angle(UP, -np.asarray(heading)), (len(clip), 4))
    rotations, translations = clip.rotations.copy(), clip.translations.copy()
    rotations[:, 0] = quat.mul(turn, clip.rotations[:, 0])
    translations[:, 0] = quat.rotate(turn, clip.translations[:, 0] - origin)
    return replace(clip, rotations=rotations, translations=translations)


def heading(clip: Clip) -> Floats:
    """Return the unwrapped angle (F,), rad, of the root about the vertical."""
    return np.unwrap(quat.twist(clip.rotations[:, 0], UP))


def _horizontal(position: Floats) -> Floats:
    return position * (1.0 - UP)


def _start_at_origin(clip: Clip) -> Clip:
    return place(clip, _horizontal(clip.root_path[0]), heading(clip)[0])


def straighten_gait(clip: Clip) -> Clip:
    """Return the clip of a gait, starting at the origin with its mean heading forward.

    The pelvis swings, so the heading is a line fitted over all frames, taken at the start.
    """
    time = np.arange(len(clip)) / (len(clip) - 1)
    _, at_start = np.polyfit(time, heading(clip), 1)
    return place(clip, _horizontal(clip.root_path[0]), at_start)


def remove_drift(clip: Clip) -> Clip:
    """Return the clip with the linear part of its travel over the floor removed."""
    translations = clip.translations.copy()
    travel = _horizontal(clip.root_path[-1] - clip.root_path[0])
    translations[:, 0] -= np.linspace(0.0, 1.0, len(clip))[:, None] * travel
    return replace(clip, translations=translations)
