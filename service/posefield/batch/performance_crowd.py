"""Crowds of performances: a stage with a character for each script, as of walking crowds.

Each performance is a motion in the frame in which its script begins, and its character stands
there. A performance that ends before the longest one keeps its last pose. Motions wait in files of
a temporary folder, so that the crowd is never in memory as a whole.

A performance has one level of detail from its begin to its end: at another level its joins are cut
elsewhere, so that no pose of one belongs to a pose of the other, and there is nothing to blend. The
level is chosen where the character is nearest to the camera.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from msgspec import structs

from posefield.batch import process_pool, scripts
from posefield.batch.scripts import ScriptRow, open_models
from posefield.common.errors import InvalidField, QueryError
from posefield.common.units import UP, Floats, RootPath, Singles
from posefield.encode.crowd_size import FILES
from posefield.inference import level_selection
from posefield.inference.level_selection import LevelCriteria
from posefield.locomotion import floor_plane, walking_crowd
from posefield.model import MAX_FRAMES
from posefield.motion import joint_roles, quat
from posefield.motion.clip import Clip, CrowdClip, Motions, Placement
from posefield.motion.skeleton import Skeleton
from posefield.performance import composition
from posefield.performance.script import Script, resolve_script
from posefield.question.motion_question import DEFAULT_BODY, BodyKind
from posefield.question.performance_question import CrowdStageQuestion, PerformanceQuestion
from posefield.question.performance_report import PerformanceAnswer, PerformanceReport
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis.synthesizer import Synthesizer


@dataclass(frozen=True)
class PerformanceCrowd:
    """Crowd of performances: its models, its file and its stage.

    models: files and folders of models besides the shipped ones. path: file to write. view: chooses
    the levels of detail; None for those of the scripts. instancing, body: as of walking crowds.
    """

    models: tuple[Path, ...]
    path: Path
    view: LevelCriteria | None = None
    instancing: str = "references"
    body: BodyKind = DEFAULT_BODY


def from_question(
    models: tuple[Path, ...], path: Path, stage: CrowdStageQuestion
) -> PerformanceCrowd:
    """Return a crowd with the stage of a question; InvalidField as for walking crowds."""
    question = WalkQuestion(**structs.asdict(stage))
    question.check()
    view = walking_crowd.criteria_of(question)
    return PerformanceCrowd(models, path, view, stage.instancing, stage.body or DEFAULT_BODY)


@dataclass(frozen=True)
class StagedMotion:
    """A performance as a motion in a file, and where its character stands.

    index: of its script. position: on the floor, x and z, m. heading: rad.
    """

    index: int
    file: Path
    level: int
    position: tuple[float, float]
    heading: float
    report: PerformanceReport


def write(
    crowd: PerformanceCrowd,
    rows: Sequence[ScriptRow],
    workers: int = 1,
    advance: Callable[[int], None] = lambda count: None,
) -> dict[str, Any]:
    """Write a crowd to a file, and return its report as plain values.

    advance: called with the number of performances that were made. Raises InvalidField, which lists
    all scripts at fault before one is performed or names one whose performance failed; FileError if
    the file cannot be written; WorkerDied.
    """
    from posefield.encode import crowd_writer

    if crowd.path.suffix.removeprefix(".") not in FILES:
        name = crowd.path.name
        raise InvalidField("output", f"{name!r} ends in none of {', '.join(FILES)}")
    skeleton, level_count = _check(crowd, rows)
    with TemporaryDirectory() as folder:
        work = partial(stage_motion, crowd, Path(folder))
        staged = []
        runner = process_pool.runner(workers, "the same command resumes")
        for motion in runner(work, iter(enumerate(rows)), lambda: False):
            staged.append(motion)
            advance(1)
        staged.sort(key=lambda motion: motion.index)
        clip = _crowd_clip(skeleton, level_count, rows, staged)
        crowd_writer.write(clip, crowd.path, crowd.instancing, crowd.body)
    levels = [motion.level for motion in staged]
    return {
        "file": str(crowd.path),
        "models": clip.facts["models"],
        "characters": len(staged),
        "frames": clip.frames,
        "rate": clip.rate,
        "level_counts": np.bincount(levels, minlength=level_count).tolist(),
        "level_shares": clip.facts["level_shares"],
        "warned": sum(bool(motion.report.warnings) for motion in staged),
    }


def _check(crowd: PerformanceCrowd, rows: Sequence[ScriptRow]) -> tuple[Skeleton, int]:
    """Return the skeleton of all scripts, and the largest number of levels of any.

    Raises InvalidField, which lists the scripts that differ from the first or have no answer.
    """
    find = open_models(crowd.models).find
    first: tuple[ScriptRow, Skeleton] | None = None
    level_count, faults = 0, list[str]()
    for row in rows:
        try:
            script = resolve_script(row.question, find)
            character = script.character
            skeleton = joint_roles.rename_joints(
                character.skeleton, character.roles, script.question.names
            )
            level_count = max(level_count, len(level_errors(script)))
            first = first or (row, skeleton)
            _check_equal(row, skeleton, *first)
            for field, value, expected in (
                ("unit", row.question.unit, "m"),
                ("up", row.question.up, "y"),
            ):
                if value not in (None, expected):
                    raise InvalidField(field, f"{value!r}, expected {expected!r} for a crowd")
            if (body := row.question.body) is not None:
                raise InvalidField("body", f"{body!r}, expected none: --body is that of a crowd")
        except QueryError as error:
            faults.append(f"{row.place}: {error}")
    if faults or first is None:
        raise scripts.faulty_scripts(faults)
    return first[1], level_count


def _check_equal(
    row: ScriptRow, skeleton: Skeleton, first: ScriptRow, first_skeleton: Skeleton
) -> None:
    """Raise InvalidField if a script has another rate or skeleton than the first."""
    rate, expected = row.question.fps, first.question.fps
    if rate != expected:
        raise InvalidField("fps", f"{rate:g}, expected {expected:g} as in {first.place}")
    same = skeleton.same_tree(first_skeleton)
    if not (same and np.array_equal(skeleton.offsets, first_skeleton.offsets)):
        raise InvalidField(
            "character",
            f"another skeleton than in {first.place}, expected the same: name one model as the "
            "`character` of all scripts",
        )


def stage_motion(crowd: PerformanceCrowd, folder: Path, job: tuple[int, ScriptRow]) -> StagedMotion:
    """Perform a script, and write its motion to a folder; QueryError names the script.

    job: index and script.
    """
    index, row = job
    find = open_models(crowd.models).find
    try:
        answer, level = perform_at_level(row.question, find, crowd.view, MAX_FRAMES)
    except QueryError as error:
        raise scripts.faulty_scripts([f"{row.place}: {error}"]) from error
    clip, start = answer.clip, row.question.start
    position, heading = start.position, start.heading
    if start.poses:
        first = floor_plane.project(clip.root_path[0])
        position = float(first.imag), float(first.real)
        heading = float(quat.twist(clip.rotations[0, 0], UP))
    rotations, roots = _relative(clip, position, heading)
    file = folder / f"{index}.npz"
    bones = clip.translations[0].astype(np.float32)
    np.savez(file, rotations=rotations, roots=roots, bones=bones)
    return StagedMotion(index, file, level, position, heading, answer.trust)


def _relative(clip: Clip, position: tuple[float, float], heading: float) -> tuple[Singles, Singles]:
    """Return rotations (F, J, 4) and root positions (F, 3), m, of a clip seen from a place."""
    left, forward = position
    back = floor_plane.unit_vectors(np.full(len(clip), -heading))
    roots = clip.root_path
    floor = (floor_plane.project(roots) - complex(forward, left)) * back
    relative = floor_plane.at_height(floor, roots[:, 1])
    turned = floor_plane.turn_roots(clip.rotations, np.full(len(clip), -heading))
    return turned.astype(np.float32), relative.astype(np.float32)


def _crowd_clip(
    skeleton: Skeleton,
    level_count: int,
    rows: Sequence[ScriptRow],
    staged: Sequence[StagedMotion],
) -> CrowdClip:
    frames = max(motion.report.frames for motion in staged)
    # Frames of each level, without those that keep the last pose.
    level_frames = np.zeros(level_count)
    for motion in staged:
        level_frames[motion.level] += motion.report.frames
    positions = np.array([motion.position for motion in staged], dtype=np.float64)
    placement = Placement(
        np.stack([positions[:, 0], np.zeros(len(positions)), positions[:, 1]], axis=1),
        np.array([motion.heading for motion in staged], dtype=np.float64),
    )
    models = dict.fromkeys(name for motion in staged for name in motion.report.models)
    return CrowdClip(
        skeleton,
        rows[0].question.fps,
        frames,
        placement,
        np.arange(len(staged)),
        _batches(frames, staged),
        {
            "models": list(models),
            "scripts": [row.name for row in rows],
            "durations": [motion.report.duration for motion in staged],
            "level_shares": [float(f"{share:.4g}") for share in level_frames / level_frames.sum()],
        },
    )


def _batches(frames: int, staged: Sequence[StagedMotion]) -> Iterator[Motions]:
    """Yield the motions one at a time, each of this number of frames: the last pose is kept."""
    for motion in staged:
        with np.load(motion.file) as arrays:
            indices = np.minimum(np.arange(frames), len(arrays["roots"]) - 1)
            yield Motions(
                arrays["rotations"][None, indices],
                arrays["roots"][None, indices],
                arrays["bones"][None],
                np.full((1, frames), motion.level),
            )


def report_text(facts: dict[str, Any]) -> str:
    """Return the report of a crowd as text."""
    levels = ", ".join(
        f"{count} at level {level}" for level, count in enumerate(facts["level_counts"]) if count
    )
    text = (
        f"{facts['file']}: {facts['characters']} characters, {facts['frames']} frames at "
        f"{facts['rate']:g} a second; {levels}"
    )
    return f"{text}\nwith a warning: {facts['warned']}" if facts["warned"] else text


def perform_at_level(
    question: PerformanceQuestion,
    find: Callable[[str], Synthesizer],
    view: LevelCriteria | None,
    frames: int,
) -> tuple[PerformanceAnswer, int]:
    """Return a performance and its level: the coarsest that the view allows.

    view: None for the level of the script. frames: the largest number. Raises QueryError as
    `composition.perform`, and for a script that has a level beside a view or a character around the
    camera.
    """
    script = resolve_script(question, find)
    if view is None:
        return composition.perform(script, frames), question.level
    if question.level:
        raise InvalidField("level", f"{question.level}, expected none: the camera chooses it")
    level = allowed_level(script, composition.compose(script).performed.roots, view)
    answer = composition.perform(_at_level(script, level), frames)
    # At another level the character may come nearer.
    while (needed := allowed_level(script, answer.clip.root_path, view)) < level:
        level = needed
        answer = composition.perform(_at_level(script, level), frames)
    return answer, level


def allowed_level(script: Script, roots: RootPath, view: LevelCriteria) -> int:
    """Return the coarsest level whose error is within the view's limit all along a path.

    roots: (F, 3), m. Raises InvalidField if the character contains the camera.
    """
    distances = np.linalg.norm(roots - view.camera.position, axis=-1)
    nearest, radius = int(np.argmin(distances)), body_radius(script)
    if distances[nearest] <= radius:
        raise InvalidField(
            "camera",
            f"{distances[nearest]:.3g} m from the middle of the character, expected more than "
            f"{radius:.3g} m",
        )
    centre = roots[nearest : nearest + 1]
    scale = level_selection.pixels_per_metre(view.camera, centre, radius)
    return int(level_selection.select_by_error(level_errors(script), scale, view.pixels)[0])


def level_errors(script: Script) -> Floats:
    """Return the errors (L,), m, of the levels that all models of a script have: the largest."""
    model_errors = [
        [level.pose for level in source.model.session.card.levels]
        for source in script.sources
        if source is not None
    ]
    count = min(map(len, model_errors))
    errors: Floats = np.max([errors[:count] for errors in model_errors], axis=0)
    return errors


def _at_level(script: Script, level: int) -> Script:
    return replace(script, question=structs.replace(script.question, level=level))


def body_radius(script: Script) -> float:
    """Return the radius, m, of a sphere about the root that contains the character at rest."""
    character = script.character
    rest = character.skeleton.at_rest(character.bones)
    return float(np.linalg.norm(rest - rest[0], axis=-1).max())
