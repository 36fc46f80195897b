"""Clips from rows of the table: cut, in metres, Y up, with heading and origin removed."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import get_args

import numpy as np

from posefield.common.errors import TrainingError, did_you_mean
from posefield.common.units import Floats, Positions
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.joint_roles import Role
from posefield.robots.file_conventions import Conventions as RobotConventions
from posefield.robots.robot import Robot
from posefield_train.robots import robot_file
from posefield_train.source import (
    canonical,
    clip_joints,
    clip_table,
    curve_files,
    data_folder,
    measured_controls,
    motion_file,
    recording_groups,
    skeleton_checks,
    unified_clips,
)
from posefield_train.source.canonical import Finding
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.common_topology import TopologyError
from posefield_train.source.measured_controls import Spans
from posefield_train.source.motion_file import MotionFile, ReadOptions
from posefield_train.source.motion_readers import MotionFiles
from posefield_train.source.recipe import Recipe
from posefield_train.source.recipe_sections import PERFORMER, Source
from posefield_train.source.skeleton_checks import RigError

# Limit of frames times joints of all files of a training: two hours of 31 joints at 120 frames a
# second, which take 2.4 GB.
MAX_POSES = 30_000_000
LEAST_RATE, MOST_RATE = 1.0, 10_000.0
"""Bounds of a model's frames a second."""
TINY = 1e-9


@dataclass(frozen=True)
class Example:
    """A clip with its controls.

    controls: (d,), from the table and measured, in the recipe's order. landmarks: fractions of the
    clip, in order. jumps: removed jumps of small joints between two frames. shift: share of a cycle
    by which the clip was shifted to begin later. recording: name of the recording; examples of one
    recording are left out together. facing: degrees from the root's +z to the body's facing in the
    file, to the left; None for a motion without a facing. captured: the clip of a cycle before its
    seam was closed; None where nothing was closed. contacts: first and last share of the clip as it
    was cut of each contact in the table, by joint. robot: whose bodies the joints are.
    """

    row: ClipRow
    clip: Clip
    controls: Floats
    landmarks: tuple[float, ...]
    jumps: tuple[Finding, ...]
    shift: float = 0.0
    recording: str = ""
    facing: float | None = 0.0
    captured: Clip | None = None
    contacts: Mapping[str, Spans] = field(default_factory=dict)
    robot: Robot | None = None

    @property
    def offsets(self) -> Floats:
        """Return the bone offsets (J, 3), m, of the performer, zero for the root."""
        return measured_controls.bone_offsets(self.clip)


def ingest(
    recipe: Recipe, folder: Path, files_read: MotionFiles | None = None
) -> tuple[list[Example], list[str]]:
    """Return the examples of a recipe, and notes on assumptions and corrections.

    files_read: files that were read before, which are not read again. Raises RecipeError for an
    invalid row, MotionFileError for a file that cannot be read.
    """
    notes = list[str]()
    rows = clip_table.read(recipe, folder, notes)
    alone = recipe.curves is not None and recipe.curves.alone
    robot = robot_conventions(recipe, folder)
    files = {} if alone else read_files(rows, recipe.source, files_read, robot)
    rate = recipe.source.rate
    curves = curve_files.find_curves(recipe.curves, rows, rate) if recipe.curves else ()
    notes += reader_notes(files)
    if recipe.source.root_offset is None:
        notes += offset_notes(files)
    # Converted once for all rows: a long file may have hundreds. Of thousands of clips each stage
    # takes hundreds of megabytes, so that the stage before is released.
    wholes = {motion: clip_of_file(files.pop(motion), recipe.source) for motion in list(files)}
    cuts = []
    for row in rows:
        values = curve_files.read(row, recipe.curves, curves, rate) if recipe.curves else None
        if values and recipe.curves and recipe.curves.rate:
            file_clip = curve_files.resting_clip(values, recipe.curves.rate)
        else:
            file_clip = wholes[row.motion]
            file_clip = curve_files.with_curves(file_clip, values, row) if values else file_clip
        cuts.append(cut_frames(file_clip, row))
    wholes.clear()
    clips, lasts = [clip for clip, _ in cuts], [last for _, last in cuts]
    cuts.clear()
    shared: Sequence[Clip] = clips
    files_of_rows, stretches = [row.file.name for row in rows], recipe.motion.bones == "stretch"
    if recipe.skeleton.is_unified:
        try:
            shared, unified_notes = unified_clips.unify_recipe(
                clips, files_of_rows, recipe.skeleton.stated, stretches
            )
        except TopologyError as fault:
            row = rows[fault.clip]
            raise row.error(f"{row.file}: {fault}") from fault
        notes += unified_notes
    left = list(reversed(shared))
    del shared, clips
    clips = [clip_joints.drop_joints(left.pop(), recipe, row) for row in rows]
    clips, joint_notes = clip_joints.in_common_order(rows, clips)
    notes += joint_notes
    motion, joints = recipe.motion, {role: recipe.joint_with(role) for role in get_args(Role)}
    directions = {"left", "forward", "step_length"}
    try:
        clips, facing, rig_notes = skeleton_checks.normalize(
            clips,
            [row.performer for row in rows],
            files_of_rows,
            facing=motion.facing,
            stretches=stretches,
            cyclic=motion.cyclic,
            directed=any(control.auto.quantity in directions for control in recipe.measured),
            roles={str(role): joint for role, joint in joints.items() if joint},
            recipe_joints=clip_joints.named_joints(recipe),
        )
    except RigError as fault:
        row = rows[fault.clip]
        raise row.error(f"{row.file}: {fault}") from fault
    notes += rig_notes if robot else [*rig_notes, *skeleton_checks.size_notes(clips)]
    clips.reverse()
    canonical.return_freed_memory()
    examples, changes, positions = list[Example](), list[float](), list[Positions]()
    for row, last in zip(rows, lasts, strict=True):
        captured = clips.pop()
        examples.append(_example(recipe, row, captured, last, facing))
        changes.append(canonical.largest_stretch(captured))
        positions.append(captured.positions())
    if robot:
        notes += frame_notes(motion.frames, [len(example.clip) for example in examples])
    landmarks = [example.landmarks for example in examples]
    measured_controls.expect_same_order(recipe.landmark_names, rows, landmarks)
    notes += stretch_notes(rows, changes)
    canonical.return_freed_memory()
    recordings, recording_notes = clip_table.stated_recordings(rows), list[str]()
    if recordings is None:
        recordings, recording_notes = recording_groups.find_recordings(
            [row.motion for row in rows],
            [row.named for row in rows],
            positions,
            examples[0].clip.skeleton.names,
        )
    examples = [
        replace(example, recording=recording, robot=robot.robot if robot else None)
        for example, recording in zip(examples, recordings, strict=True)
    ]
    return examples, [*recording_notes, *notes]


def read_files(
    rows: Sequence[ClipRow],
    source: Source,
    files_read: MotionFiles | None = None,
    robot: RobotConventions | None = None,
) -> dict[str, MotionFile]:
    """Return the motions of rows by their names, each content read once.

    robot: whose reference motions the files hold, if they do.

    Raises MotionFileError for a file that cannot be read and RecipeError for more than MAX_POSES in
    all. A file that states another unit or up axis than the source is overruled, with a note.
    """
    files_read, files = files_read or MotionFiles(), dict[str, MotionFile]()
    poses = 0
    for row in rows:
        if row.motion not in files:
            files[row.motion] = files_read.read(
                row.file, ReadOptions(source.rate, row.animation, robot=robot)
            )
            poses += files[row.motion].poses
        if poses > MAX_POSES:
            raise row.error(
                f"found {poses} poses of a joint in the files up to {row.file}, expected at most "
                f"{MAX_POSES}"
            )
    return {name: _as_stated(file, source, files.values()) for name, file in files.items()}


def robot_conventions(recipe: Recipe, folder: Path) -> RobotConventions | None:
    """Return the robot of a recipe and the conventions of its files; None for other recipes."""
    stated = recipe.robot
    if stated is None:
        return None
    body = robot_file.read(Path(str(data_folder.find(folder, stated.model))))
    rate, degrees = recipe.source.rate, stated.degrees
    return RobotConventions(body, rate, stated.quaternions, stated.order, degrees)


def _as_stated(file: MotionFile, source: Source, other_files: Collection[MotionFile]) -> MotionFile:
    """Return a file with the unit and up axis of the source, or its own where those fit better.

    Beside files that state no unit, whose unit the source says, one that states its own keeps it if
    its bones then are nearer to the length of theirs.
    """
    silent = [_bone_length(other) for other in other_files if other.metres_per_unit is None]
    unit, up, stated = source.metres_per_unit, source.up, file.metres_per_unit
    if stated is None or not silent:
        return motion_file.overrule(file, ReadOptions(metres_per_unit=unit, up=up))
    median, length = unit * float(np.median(silent)), _bone_length(file)
    ratios = [
        abs(np.log(max(length * candidate, TINY) / max(median, TINY)))
        for candidate in (stated, unit)
    ]
    if ratios[0] >= ratios[1]:
        return motion_file.overrule(file, ReadOptions(metres_per_unit=unit, up=file.up or up))
    note = f"states a unit of {stated:g} m, kept: with it the bones are as long as those of others"
    return replace(file, up=file.up or up, notes=(*file.notes, note))


def _bone_length(file: MotionFile) -> float:
    return float(np.linalg.norm(file.skeleton.offsets[1:], axis=-1).sum())


def _example(
    recipe: Recipe, row: ClipRow, captured: Clip, last: int, facing: float | None
) -> Example:
    motion, has_facing = recipe.motion, facing is not None
    in_place = motion.root == "in_place"
    if recipe.robot and motion.cyclic:
        expect_cycle(captured, row)
    opened, jumps = canonical.without_jumps(captured, motion.cyclic, has_facing)
    clip = canonical.closed(opened, motion.cyclic, in_place)
    before = canonical.closed(opened, False, in_place) if motion.cyclic else None
    marks = measured_controls.landmarks(row, last, recipe.clips.landmarks)
    event = recipe.event
    if event is not None and event.is_found:
        joint = clip.skeleton.names.index(event.joint)
        share = measured_controls.moment_share(clip, joint, event.at)
        marks += (measured_controls.event_landmark(row, event.joint, event.at, share),)
    values = measured_controls.control_values(recipe, row, clip, marks)
    spans = measured_controls.contact_spans(row, last, recipe.contacts.columns)
    return Example(row, clip, values, marks, jumps, facing=facing, captured=before, contacts=spans)


SEAM, SEAM_RATIO = np.radians(15.0), 3.0
"""Turn of a robot's joint from the last frame to the first, alone and over its largest step."""


def expect_cycle(clip: Clip, row: ClipRow) -> None:
    """Raise RecipeError for a robot's clip whose last frame is not the first of its next cycle."""
    rotations = clip.rotations[:, 1:]
    ahead = np.concatenate([rotations[1:], rotations[:1]])
    steps = np.linalg.norm(quat.log(quat.mul(quat.conj(rotations), ahead)), axis=-1)
    largest = steps[:-1].max(initial=0.0)
    joint = int(np.argmax(steps[-1]))
    if steps[-1, joint] > max(SEAM, SEAM_RATIO * largest):
        raise row.error(
            f"{row.file}: joint {clip.skeleton.names[joint + 1]!r} turns by "
            f"{np.degrees(steps[-1, joint]):.1f} degrees from the last frame to the first, and by "
            f"{np.degrees(largest):.1f} at most between others: expected a cycle (motion.cyclic)"
        )


def clip_of_file(file: MotionFile, source: Source) -> Clip:
    """Return the clip of all frames of a file.

    By default position channels replace the root's OFFSET. Raises MotionFileError for a rate that a
    model cannot have.
    """
    if file.rate is not None and not LEAST_RATE <= file.rate <= MOST_RATE:
        _, doubt = motion_file.doubted_rate(file.rate)
        raise file.error(f"{file.evidence}, {file.rate:.3g} frames a second: {doubt}")
    return motion_file.to_clip(
        file,
        metres_per_unit=file.metres_per_unit or source.metres_per_unit,
        up=file.up or source.up,
        root_offset=source.root_offset or "replace",
    )


def cut_frames(clip: Clip, row: ClipRow) -> tuple[Clip, int]:
    """Return the frames that a row names, and the index of the last of them in the file.

    Raises RecipeError for a frame that the file lacks, and for a single frame.
    """
    last = len(clip) - 1 if row.last_frame is None else row.last_frame
    if last >= len(clip):
        raise row.error(f"frame {last}, but {row.file} has frames 0 to {len(clip) - 1}")
    if last <= row.first_frame:
        raise row.error(f"{row.file} has frames 0 to {last}, expected two or more")
    return clip.part(slice(row.first_frame, last + 1)), last


BVH = "BVH"
RIGID_TOLERANCE = 1e-4
"""Bones that stretch by less than this are taken as rigid without a note, m."""


def stretch_notes(rows: Sequence[ClipRow], stretches: Sequence[float]) -> list[str]:
    """Return the note on bones that stretch, with the worst clip; none if all are rigid.

    stretches: largest change of a bone's length in the clip of each row, m.
    """
    worst = int(np.argmax(stretches))
    count = int(np.sum(np.asarray(stretches) > RIGID_TOLERANCE))
    if not count:
        return []
    largest = f"bones stretch by up to {stretches[worst]:.4f} m"
    if count == 1:
        return [f"{rows[worst].file}: {largest}; their mean is kept"]
    return [
        f"{count} of {len(rows)} clips: {largest}, the most in {rows[worst].file}; their mean is "
        "kept"
    ]


def frame_notes(frames: int, lengths: Sequence[int]) -> list[str]:
    """Return the note on poses of a robot's motions between those of the model; none if all are.

    frames: of the model. lengths: frames of each clip. Reference motions are exact in each frame
    and turn abruptly at contacts, so that poses between two frames are not those of the file.
    """
    longest = max(lengths)
    if frames > longest or (frames - 1) % (longest - 1) == 0:
        return []
    return [
        f"motion.frames is {frames}, and clips have up to {longest} frames: poses between those of "
        f"the model are interpolated; expected {longest} frames to keep them"
    ]


def offset_notes(files: Mapping[str, MotionFile]) -> list[str]:
    """Return the note on the interpretation of root OFFSETs that are not zero; none if all are.

    files: motion files by place; those of other formats than BVH have no OFFSET.
    """
    offsets = {
        name: tuple(file.skeleton.offsets[0].tolist())
        for name, file in files.items()
        if file.format == BVH and file.skeleton.offsets[0].any()
    }
    if not offsets:
        return []
    name, offset = next(iter(offsets.items()))
    which = "" if len(offsets) == 1 else f"{len(offsets)} of {len(files)} files, the first of them "
    return [
        f"{which}{name}: the root's OFFSET is {offset} and has position channels, which were "
        "taken to replace it; say so as source.root_offset"
    ]


def reader_notes(files: Mapping[str, MotionFile]) -> list[str]:
    """Return the notes of readers on what they assumed, each of several files once.

    files: motion files by place.
    """
    names_by_note: dict[str, list[str]] = {}
    for name, file in files.items():
        for note in file.notes:
            names_by_note.setdefault(note, []).append(name)
    return [
        (note if len(names) == 1 else f"{len(names)} of {len(files)} files: {note}")
        if len(names) > 1 or note.startswith((names[0], Path(names[0]).name))
        else f"{Path(names[0]).name}: {note}"
        for note, names in names_by_note.items()
    ]


def check_presets(recipe: Recipe, examples: Sequence[Example]) -> None:
    """Raise TrainingError for a preset outside the sampled ranges or of an unknown label."""
    points = np.stack([example.controls for example in examples])
    lowest, highest = points.min(axis=0), points.max(axis=0)
    for name, preset in recipe.presets.items():
        for index, control in enumerate(recipe.controls):
            value, low, high = preset.values[control.name], lowest[index], highest[index]
            if not low <= value <= high:
                raise TrainingError(
                    f"presets.{name}.{control.name}: found {value:g}, expected {low:g} to "
                    f"{high:g}, the sampled range"
                )
        for label_set, label in preset.labels.items():
            labels = sorted({example.row.labels[label_set] for example in examples})
            if label not in labels:
                key = label_set if label_set == PERFORMER else f"labels.{label_set}"
                raise TrainingError(
                    f"presets.{name}.{key}: found {label!r}{did_you_mean(label, labels)}, expected "
                    f"one of {', '.join(labels)}"
                )
