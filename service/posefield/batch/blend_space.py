"""Blend spaces for game engines: looping clips on a grid, and what blending them costs.

An engine plays the clips around a point at once, each by its weight, in step by equal shares of the
cycle. `measure` blends in this way, and compares poses with the model's between the grid's points.
Controls that are no axes are interpolated between the corners of the grid, as blending does: those
that are inferred at each point jump from the typical clips of one to those of the next.
"""

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Annotated, Any

import numpy as np
from msgspec import structs

from posefield.batch import layouts, tables
from posefield.batch.rows import Row, RowReader, parse_grid
from posefield.batch.tables import Column, Columns, RawRow
from posefield.common.errors import InvalidField, QueryError
from posefield.common.units import UP, Floats, Frames, Positions, Rotations
from posefield.motion import quat, root_bone, skeleton
from posefield.motion.clip import Clip
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer, GridAxis
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

FILE = "blendspace.json"
MOST_SAMPLES = 400
"""Clips of the largest blend space; all are in memory while they are compared."""
MOST_AXES = 2
"""Axes of the blend spaces of Unreal Engine, Unity and Godot."""


@dataclass(frozen=True)
class Sample:
    """Looping clip as an engine plays it: poses in the frame of its root, and the root's way.

    rotations (F, J, 4), translations (F, J, 3): local to the parents, m; the last frame equals the
    first. duration: of a cycle, s. markers: time, s, at which each foot comes down, by name. speed:
    along the way, m/s. travel: over the floor, x and z, m. turn: change of heading, rad.
    """

    joints: skeleton.Skeleton
    rotations: Rotations
    translations: Positions
    duration: float
    markers: Mapping[str, float]
    speed: float
    travel: tuple[float, float]
    turn: float

    @property
    def steps(self) -> int:
        """Return the number of frames of a cycle."""
        return len(self.rotations) - 1

    def at(self, shares: Frames) -> tuple[Rotations, Positions]:
        """Return the poses at shares (S,) of the cycle, between frames as engines interpolate."""
        frames = (shares % 1.0) * self.steps
        before = np.minimum(frames.astype(np.int64), self.steps - 1)
        share = frames - before
        turns = quat.nlerp(self.rotations[before], self.rotations[before + 1], share)
        return turns, quat.lerp(self.translations[before], self.translations[before + 1], share)


@dataclass(frozen=True)
class BlendSpace:
    """Samples at all points of a grid; the last axis varies fastest.

    corners: all controls at the corners of the grid, in the order of samples.
    """

    axes: Sequence[GridAxis]
    corners: Sequence[Mapping[str, float]]
    samples: Sequence[Sample] = ()

    def controls(self, point: Sequence[float]) -> dict[str, float]:
        """Return all controls at a point of the grid."""
        weights = _weights([axis.values[[0, -1]] for axis in self.axes], point)
        controls = {
            name: sum(weight * self.corners[corner][name] for corner, weight in weights.items())
            for name in self.corners[0]
        }
        names = [axis.control.name for axis in self.axes]
        return {**controls, **dict(zip(names, map(float, point), strict=True))}

    def weights(self, point: Sequence[float]) -> dict[int, float]:
        """Return the weight of each sample about a point of the grid, by index: bilinear."""
        return _weights([axis.values for axis in self.axes], point)

    def blend(self, point: Sequence[float], shares: Frames) -> tuple[Rotations, Positions]:
        """Return the blended poses at shares (S,) of the cycle."""
        turns: list[Floats] = []
        shifts: list[Floats] = []
        for index, weight in self.weights(point).items():
            rotations, translations = self.samples[index].at(shares)
            if turns:
                dots = np.sum(rotations * turns[0], axis=-1, keepdims=True)
                rotations = np.where(dots < 0.0, -rotations, rotations)
            turns.append(weight * rotations)
            shifts.append(weight * translations)
        return quat.normalize(np.sum(turns, axis=0)), np.sum(shifts, axis=0)

    def speed(self, point: Sequence[float]) -> float:
        """Return the speed of the blended root, m/s: engines blend lengths and travels."""
        weights = self.weights(point).items()
        ways = sum(w * self.samples[i].speed * self.samples[i].duration for i, w in weights)
        return float(ways / sum(w * self.samples[i].duration for i, w in weights))


def _weights(axes: Sequence[Floats], point: Sequence[float]) -> dict[int, float]:
    """Return the weights of the points of a grid, by index, that interpolate at a point."""
    weights = {0: 1.0}
    for values, value in zip(axes, point, strict=True):
        place = float(np.interp(value, values, np.arange(len(values))))
        before = min(int(place), len(values) - 2)
        ends = {before: before + 1.0 - place, before + 1: place - before}
        weights = {
            index * len(values) + end: weight * share
            for (index, weight), (end, share) in product(weights.items(), ends.items())
            if share > 0.0
        }
    return weights


def open_grid(
    model: Synthesizer, source: RowReader, grid: Sequence[str]
) -> tuple[BlendSpace, RowReader]:
    """Return a blend space without samples, and their rows, which are named by their places.

    grid: texts of which the source was opened. Raises InvalidField for what engines cannot blend.
    """
    card = model.session.card
    controls = {control.name: control for control in card.controls}
    table = tables.table_columns(card)
    columns = parse_grid(grid, table)
    axes, fixed = [], {}
    for column, texts in columns:
        if column.group != "controls":
            raise InvalidField("grid", f"{column.name!r}, expected a control: engines blend those")
        values = np.array([float(text) for text in texts])
        if np.any(np.diff(values) <= 0.0):
            raise InvalidField("grid", f"{column.name!r}: {texts}, expected rising values")
        if len(values) == 1:
            fixed[column.name] = float(values[0])
        else:
            axes.append(GridAxis(controls[column.name], values))
    if not 1 <= len(axes) <= MOST_AXES:
        expected = f"expected 1 to {MOST_AXES}, as blend spaces of engines have"
        raise InvalidField("grid", f"{len(axes)} controls with more than one value, {expected}")
    count = int(np.prod([len(axis.values) for axis in axes]))
    if count > MOST_SAMPLES:
        raise InvalidField("grid", f"{count} clips, expected at most {MOST_SAMPLES}")
    names = [axis.control.name for axis in axes]
    corners = []
    for ends in product(*(axis.values[[0, -1]].tolist() for axis in axes)):
        corner = {**fixed, **dict(zip(names, ends, strict=True))}
        question = structs.replace(source.question, controls=corner)
        corners.append({**model.question(question).controls, **corner})
    space = BlendSpace(axes, corners)
    digest = hashlib.sha256(f"blend space {source.digest}".encode()).hexdigest()
    raw = partial(_rows_by_place, source, space, table)
    return space, replace(source, raw=raw, has_names=True, digest=digest)


def _rows_by_place(source: RowReader, space: BlendSpace, columns: Columns) -> Iterator[RawRow]:
    """Yield the rows of a grid with a name of their values, such as speed1.2_turn10."""
    for location, cells in source.raw():
        if isinstance(cells, QueryError):
            raise cells
        values = {column.name: float(text) for column, text in cells}
        name = "_".join(f"{control}{value:g}" for control, value in values.items())
        named = (Column("name"), re.sub(r"[^A-Za-z0-9._-]", "_", name))
        controls = space.controls([values[axis.control.name] for axis in space.axes])
        given = [(columns[f"controls/{key}"], repr(value)) for key, value in controls.items()]
        yield location, [named, *given]


def synthesize(model: Synthesizer, rows: Sequence[Row[ClipQuestion]]) -> list[Sample]:
    """Return the samples of questions for loops; raises the QueryError of one without an answer."""
    questions = [row.question for row in rows]
    travelling = [structs.replace(question, root="travelling") for question in questions]
    ways = _answers(model, travelling)
    poses = ways
    if questions and questions[0].root == "in_place":
        poses = _answers(model, questions)
    roles = {joint: role for role, joint in model.session.card.roles.items()}
    return [_sample(way, pose.clip, roles) for way, pose in zip(ways, poses, strict=True)]


def _answers(model: Synthesizer, questions: Sequence[ClipQuestion]) -> list[ClipAnswer]:
    answers = []
    for answer in clips.synthesize_clips(model, questions):
        if isinstance(answer, QueryError):
            raise answer
        answers.append(answer)
    return answers


def _sample(answer: ClipAnswer, poses: Clip, roles: Mapping[str, str]) -> Sample:
    """Return a sample. answer: with the travel. poses: in place or not. roles: by joint."""
    rooted = root_bone.add_root(answer.clip, root_bone.with_root(answer.clip.skeleton))
    path, duration = rooted.root_path, answer.clip.duration
    heading = np.unwrap(quat.twist(rooted.rotations[:, 0], UP))
    if poses is answer.clip:
        rotations, translations = rooted.rotations[:, 1:], rooted.translations[:, 1:]
    else:
        rotations, translations = poses.rotations, poses.translations
    stances = answer.trust.feet.stances if answer.trust.feet else ()
    names = [f"{roles.get(stance.joint, stance.joint)}_down" for stance in stances]
    share = duration / answer.trust.duration
    times = [stance.begin * share % duration for stance in stances]
    return Sample(
        answer.clip.skeleton,
        quat.unroll(rotations),
        translations,
        duration,
        # A foot that comes down twice in a cycle has no marker of one name.
        {} if len({*names}) < len(names) else dict(zip(names, times, strict=True)),
        float(np.linalg.norm(np.diff(path, axis=0), axis=-1).sum()) / duration,
        (float(path[-1, 0] - path[0, 0]), float(path[-1, 2] - path[0, 2])),
        float(heading[-1] - heading[0]),
    )


def measure(model: Synthesizer, space: BlendSpace, row: Row[ClipQuestion]) -> dict[str, Any]:
    """Return the errors of blended poses halfway between the grid's points, cm, and of speeds, m/s.

    row: any of the grid. Errors are distances of joints in the frame of the root, over all frames
    of the model's clips, whose controls may be unsupported where those of the grid are not.
    """
    halves = [
        np.interp(np.arange(2 * len(a.values) - 1) / 2, np.arange(len(a.values)), a.values)
        for a in space.axes
    ]
    indices = [i for i in product(*(range(len(half)) for half in halves)) if any(k % 2 for k in i)]
    points = [[float(half[k]) for half, k in zip(halves, i, strict=True)] for i in indices]
    questions = [
        structs.replace(row.question, controls=space.controls(point), extrapolate="ok")
        for point in points
    ]
    truths = synthesize(model, [replace(row, question=question) for question in questions])
    pairs = [*zip(points, truths, strict=True)]
    distances = [_distances(space, *pair) for pair in pairs]
    together = np.concatenate([gaps.ravel() for gaps in distances])
    largest = int(np.argmax([gaps.max() for gaps in distances]))
    frame, joint = np.unravel_index(int(np.argmax(distances[largest])), distances[largest].shape)
    point, truth = pairs[largest]
    return {
        "points": len(pairs),
        "rms_cm": round(100.0 * float(np.sqrt(np.mean(together**2))), 3),
        "p99_cm": round(100.0 * float(np.percentile(together, 99.0)), 3),
        "worst_cm": round(100.0 * float(together.max()), 3),
        "worst_at": list(point),
        "worst_joint": truth.joints.names[joint],
        "worst_phase": round(float(frame) / truth.steps, 4),
        "speed": round(max(abs(space.speed(at) - truth.speed) for at, truth in pairs), 4),
    }


def _distances(
    space: BlendSpace, point: Sequence[float], truth: Sample
) -> Annotated[Floats, "frames joints"]:
    """Return the distances (F, J), m, of blended joints from the model's."""
    blended = space.blend(point, np.arange(truth.steps) / truth.steps)
    exact = truth.rotations[:-1], truth.translations[:-1]
    parents = truth.joints.parents
    gaps = skeleton.positions(parents, *blended) - skeleton.positions(parents, *exact)
    distances: Floats = np.linalg.norm(gaps, axis=-1)
    return distances


def document(
    model: Synthesizer,
    space: BlendSpace,
    rows: Sequence[Row[ClipQuestion]],
    errors: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the content of `blendspace.json`: lengths in m, times in s, angles in rad."""
    question, places = rows[0].question, product(*(axis.values.tolist() for axis in space.axes))
    in_place = question.root == "in_place"
    root = "in_place" if in_place else "bone" if question.root_bone else "travelling"
    return {
        "version": 1,
        "model": model.identity,
        "axes": [
            {"name": a.control.name, "unit": a.control.unit, "values": a.values.tolist()}
            for a in space.axes
        ],
        "fps": question.fps,
        "root": root,
        "error": errors,
        "samples": [
            {
                "file": layouts.path(index, row.name, row.format),
                "at": list(place),
                "controls": space.controls(place),
                "duration": sample.duration,
                "frames": sample.steps + 1,
                "speed": sample.speed,
                "turn_rate": sample.turn / sample.duration,
                "root_motion": {"x": sample.travel[0], "z": sample.travel[1], "turn": sample.turn},
                "markers": sample.markers,
            }
            for index, (row, place, sample) in enumerate(
                zip(rows, places, space.samples, strict=True)
            )
        ],
    }


def sentences(facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield what a user should know of a blend space's errors."""
    error = facts["error"]
    at = ", ".join(
        f"{axis['name']} {value:g}"
        for axis, value in zip(facts["axes"], error["worst_at"], strict=True)
    )
    yield (
        f"poses: {error['rms_cm']:.2f} cm from the model between grid points (root mean square; "
        f"99 % below {error['p99_cm']:.1f} cm, at most {error['worst_cm']:.1f} cm: "
        f"{error['worst_joint']} at {at})"
    )
    yield f"speed: at most {error['speed']:.3f} m/s from the model between grid points"
