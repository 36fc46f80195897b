"""Blend spaces for game engines: looping clips on a grid, and what blending them costs.

An engine plays the clips around a point at once, each by its weight. It keeps them in step either
by markers, which are the times at which feet come down, or by equal shares of the cycle. `measure`
blends as engines do, and compares poses with those of the model halfway between the grid's points.
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
from posefield.batch.tables import Column, RawRow
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

    def at(self, times: Frames) -> tuple[Rotations, Positions]:
        """Return the poses at times (S,), s, between frames as engines interpolate."""
        frames = (times / self.duration % 1.0) * self.steps
        before = np.minimum(frames.astype(np.int64), self.steps - 1)
        share = frames - before
        turns = quat.nlerp(self.rotations[before], self.rotations[before + 1], share)
        return turns, quat.lerp(self.translations[before], self.translations[before + 1], share)


@dataclass(frozen=True)
class BlendSpace:
    """Samples at all points of a grid; the last axis varies fastest. fixed: further controls."""

    axes: Sequence[GridAxis]
    fixed: Mapping[str, float]
    samples: Sequence[Sample]

    @property
    def markers(self) -> tuple[str, ...]:
        """Return the names of the markers in the order of a cycle; none if samples differ in it."""
        orders = [_order(sample.markers) for sample in self.samples]
        return orders[0] if len({*orders}) == 1 else ()

    def weights(self, point: Sequence[float]) -> dict[int, float]:
        """Return the weight of each sample about a point of the grid, by index: bilinear."""
        weights = {0: 1.0}
        for axis, value in zip(self.axes, point, strict=True):
            place = float(np.interp(value, axis.values, np.arange(len(axis.values))))
            before = min(int(place), len(axis.values) - 2)
            ends = {before: before + 1.0 - place, before + 1: place - before}
            weights = {
                index * len(axis.values) + end: weight * share
                for (index, weight), (end, share) in product(weights.items(), ends.items())
                if share > 0.0
            }
        return weights

    def blend(
        self, point: Sequence[float], times: Frames, leader: Sample, synchronisation: str
    ) -> tuple[Rotations, Positions]:
        """Return the blended poses at times (S,), s, of a leader that the samples follow."""
        turns: list[Floats] = []
        shifts: list[Floats] = []
        for index, weight in self.weights(point).items():
            sample = self.samples[index]
            rotations, translations = sample.at(
                self._followed(times, leader, sample, synchronisation)
            )
            if turns:
                dots = np.sum(rotations * turns[0], axis=-1, keepdims=True)
                rotations = np.where(dots < 0.0, -rotations, rotations)
            turns.append(weight * rotations)
            shifts.append(weight * translations)
        return quat.normalize(np.sum(turns, axis=0)), np.sum(shifts, axis=0)

    def _followed(
        self, times: Frames, leader: Sample, follower: Sample, synchronisation: str
    ) -> Frames:
        """Return the times (S,), s, of a follower at those of its leader."""
        if synchronisation == "phase":
            return times / leader.duration * follower.duration
        places, ticks = _ticks(leader, self.markers), _ticks(follower, self.markers)
        followed: Frames = np.interp(times, places, ticks)
        return followed

    def speed(self, point: Sequence[float]) -> float:
        """Return the speed of the blended root, m/s: engines blend lengths and travels."""
        weights = self.weights(point).items()
        ways = sum(w * self.samples[i].speed * self.samples[i].duration for i, w in weights)
        return float(ways / sum(w * self.samples[i].duration for i, w in weights))


def _order(markers: Mapping[str, float]) -> tuple[str, ...]:
    """Return the names of markers by time, begun with the first in the alphabet."""
    names = sorted(markers, key=lambda name: markers[name])
    start = names.index(min(names)) if names else 0
    return (*names[start:], *names[:start])


def _ticks(sample: Sample, names: Sequence[str]) -> Annotated[Floats, "ticks"]:
    """Return the times, s, of markers in this order over the cycles before, at and after one."""
    times = np.array([sample.markers[name] for name in names])
    later = times + sample.duration * (times < times[0])
    return np.concatenate([later + cycle * sample.duration for cycle in (-1, 0, 1)])


def open_grid(
    model: Synthesizer, source: RowReader, grid: Sequence[str]
) -> tuple[list[GridAxis], dict[str, float], RowReader]:
    """Return the axes of a blend space, its fixed controls, and the rows named by their places.

    grid: texts of which the source was opened. Raises InvalidField for what engines cannot blend.
    """
    card = model.session.card
    controls = {control.name: control for control in card.controls}
    columns = parse_grid(grid, tables.table_columns(card))
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
    digest = hashlib.sha256(f"blend space {source.digest}".encode()).hexdigest()
    raw = partial(_rows_by_place, source, [column for column, _ in columns])
    return axes, fixed, replace(source, raw=raw, has_names=True, digest=digest)


def _rows_by_place(source: RowReader, columns: Sequence[Column]) -> Iterator[RawRow]:
    """Yield the rows of a grid with a name of their values, such as speed1.2_turn10."""
    for location, cells in source.raw():
        if isinstance(cells, QueryError):
            raise cells
        values = list(cells)
        name = "_".join(f"{column.name}{float(text):g}" for column, text in values)
        named = (Column("name"), re.sub(r"[^A-Za-z0-9._-]", "_", name))
        yield location, [named, *values]


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
    names = [axis.control.name for axis in space.axes]
    questions = [
        structs.replace(
            row.question,
            controls={**space.fixed, **dict(zip(names, point, strict=True))},
            extrapolate="ok",
        )
        for point in points
    ]
    truths = synthesize(model, [replace(row, question=question) for question in questions])
    speeds = [abs(space.speed(p) - truth.speed) for p, truth in zip(points, truths, strict=True)]
    errors: dict[str, Any] = {"speed": round(max(speeds), 4)}
    compared = list(zip(points, truths, strict=True))
    in_step = [pair for pair in compared if _order(pair[1].markers) == space.markers]
    for name, pairs in (("markers", in_step if space.markers else []), ("phase", compared)):
        if pairs:
            errors[name] = _statistics(space, pairs, name)
    return errors


def _distances(
    space: BlendSpace, point: Sequence[float], truth: Sample, synchronisation: str
) -> Annotated[Floats, "frames joints"]:
    """Return the distances (F, J), m, of blended joints from the model's."""
    times = np.arange(truth.steps) / truth.steps * truth.duration
    blended = space.blend(point, times, truth, synchronisation)
    exact = truth.rotations[:-1], truth.translations[:-1]
    parents = truth.joints.parents
    gaps = skeleton.positions(parents, *blended) - skeleton.positions(parents, *exact)
    distances: Floats = np.linalg.norm(gaps, axis=-1)
    return distances


def _statistics(
    space: BlendSpace, pairs: Sequence[tuple[Sequence[float], Sample]], synchronisation: str
) -> dict[str, Any]:
    """Return the errors at points with the model's samples, cm, and where the largest is."""
    distances = [_distances(space, *pair, synchronisation) for pair in pairs]
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
    }


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
        "fixed": dict(space.fixed),
        "fps": question.fps,
        "root": root,
        "markers": list(space.markers),
        "error": errors,
        "samples": [
            {
                "file": layouts.path(index, row.name, row.format),
                "at": list(place),
                "duration": sample.duration,
                "frames": sample.steps + 1,
                "speed": sample.speed,
                "turn_rate": sample.turn / sample.duration,
                "root_motion": {"x": sample.travel[0], "z": sample.travel[1], "turn": sample.turn},
                "markers": {name: sample.markers[name] for name in space.markers},
            }
            for index, (row, place, sample) in enumerate(
                zip(rows, places, space.samples, strict=True)
            )
        ],
    }


WAYS = {"markers": "in step by the markers", "phase": "in step by shares of the cycle"}


def sentences(facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield what a user should know of a blend space's errors."""
    if not facts["markers"]:
        yield "no markers: feet do not come down in one order in all clips, or are not known"
    error = facts["error"]
    for synchronisation, way in WAYS.items():
        if (numbers := error.get(synchronisation)) is not None:
            at = ", ".join(
                f"{axis['name']} {value:g}"
                for axis, value in zip(facts["axes"], numbers["worst_at"], strict=True)
            )
            yield (
                f"{way}: {numbers['rms_cm']:.2f} cm from the model between grid points (root mean "
                f"square; 99 % below {numbers['p99_cm']:.1f} cm, at most {numbers['worst_cm']:.1f} "
                f"cm: {numbers['worst_joint']} at {at})"
            )
    yield f"speed: at most {error['speed']:.3f} m/s from the model between grid points"
