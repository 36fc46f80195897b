"""Crowds of people who walk along tracks."""

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
from msgspec import structs

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.locomotion import collision_avoidance, floor_plane, walking_crowd
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.walking_crowd import MAX_POSES, POSES_PER_BATCH, MotionsWithContacts
from posefield.motion.clip import CrowdClip, Motions, Placement, StandingFeet
from posefield.performance import holds
from posefield.performance.step_plan import Strider
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis import walking_feet
from posefield.synthesis.synthesizer import Synthesizer
from posefield.tracks import track_path, track_plan
from posefield.tracks.track import Track, TrackSet
from posefield.tracks.track_path import TrackPath

SIZES = (0.94, 1.06)
"""Heights of people over those of the model's performers."""
TAKES = 2**31
"""Number of takes from which one is drawn for a person."""
MOST_SPEED = 2.2
"""Speed up to which people walk, m/s; beyond it their feet slide, which is told."""
SLOW, WAY = 0.25, 2.0
"""Speed that all stay below, m/s, and distance that one goes nevertheless, m, which is told."""
FAR, ASIDE = 0.08, np.radians(45.0)
"""Distance from a track, m, and angle from a given heading, rad, that are told."""
LONG_STEP, STEPS = 1.5, 5.0
"""Time without a sample, s, and in usual steps of the track, beyond which it is told."""
MOST_FRAMES = 1_000_000
"""Frames of a crowd's clock: nine hours at 30 frames a second, 0.4 GB a person."""
MOST_LINES = 20
"""Lines about people that a terminal and the headers of a response show."""


@dataclass(frozen=True)
class Person:
    """Person who walks along a track: the same for the same id and seed.

    number: random one that chooses the labels. phase, sway: random ones of the plan. scale: height
    over that of the model. take: seed of the motion.
    """

    track: Track
    path: TrackPath
    number: float
    phase: float
    sway: float
    scale: float
    take: int


class PersonLimit(NamedTuple):
    """Limit of a walker that a track passes: by what ratio, and a line about it."""

    excess: float
    text: str


@dataclass(frozen=True)
class TrackCrowd:
    """People on tracks, and how their motions are made.

    people: in the order of the tracks. frames: of the clock that all share. begin: time of the
    first frame, s, as in the file. skipped: reason by id of tracks too short for two frames.
    """

    model: Synthesizer
    gait: Gait
    question: WalkQuestion
    people: tuple[Person, ...]
    begin: float
    frames: int
    skipped: dict[str, str]

    @cached_property
    def limits(self) -> list[PersonLimit]:
        """Limits of walkers that their tracks pass, the worst first."""
        limits = [limit for person in self.people for limit in _limits(self, person)]
        paths = [person.path for person in self.people]
        fastest = max((np.abs(path.velocities).max() for path in paths), default=0.0)
        gone = max((abs(path.points[-1] - path.points[0]) for path in paths), default=0.0)
        if fastest < SLOW and gone > WAY:
            text = f"all are slower than {SLOW:g} m/s: are times in frames or milliseconds?"
            limits.append(PersonLimit(SLOW / fastest * 1e3, text))
        return sorted(limits, key=lambda limit: -limit.excess)

    @cached_property
    def striders(self) -> tuple[Strider, ...]:
        """Strides of the model's walkers."""
        return track_plan.find_striders(self.gait)

    def batches(self) -> Iterator[tuple[Sequence[Person], LocomotionPlan, Motions]]:
        """Yield people with their plans and motions, neighbours of equal length together.

        The plan is in the world and in the model's size. Motions begin at the start of their paths,
        each from its first frame, and have their people's sizes. None depends on other people: a
        crowd may be made in parts.
        """
        batch, poses = list[Person](), 0
        for person in self.people:
            if batch and poses + len(person.path) > POSES_PER_BATCH:
                yield from self._motions(batch)
                batch, poses = [], 0
            batch.append(person)
            poses += len(person.path)
        if batch:
            yield from self._motions(batch)

    def _motions(
        self, people: Sequence[Person]
    ) -> Iterator[tuple[Sequence[Person], LocomotionPlan, Motions]]:
        groups = [list(group) for _, group in groupby(people, lambda person: len(person.path))]
        plans, predicted = zip(*map(self._predict, groups), strict=True)
        card, made = self.gait.session.card, [motions for motions, _ in predicted]
        if walking_feet.wants_standing_feet(card, self.question):
            made = walking_feet.stand(card, self.question.fps, predicted)
        for group, plan, motions in zip(groups, plans, made, strict=True):
            size = np.array([person.scale for person in group], np.float32)[:, None, None]
            roots, bones = motions.root_position * size, motions.bone_offsets * size
            yield group, plan, replace(motions, root_position=roots, bone_offsets=bones)

    def _predict(self, people: Sequence[Person]) -> tuple[LocomotionPlan, MotionsWithContacts]:
        """Return the plan and the motions of people of equal length, in the model's size."""
        cancellation.check()
        rate, card = self.question.fps, self.gait.session.card
        combinations = self.gait.labels.draw(np.array([person.number for person in people]))
        draws = np.array([person.phase for person in people])
        scales = np.array([person.scale for person in people])
        paths = [person.path for person in people]
        plan = track_plan.plan_people(self.striders, paths, combinations, draws, scales, rate)
        takes = walking_feet.of_question(card, structs.replace(self.question, count=len(people)))
        if takes is not None and takes.take == "index":
            takes = replace(takes, seeds=np.array([person.take for person in people]))
        predict = walking_feet.with_takes(walking_crowd.motions_with_contacts, self.model, takes)
        starts = np.array([path.points[0] for path in paths]) / scales
        relative = replace(plan, places=plan.places - starts[:, None])
        world = replace(plan, places=plan.places * scales[:, None])
        levels = walking_crowd.build_schedule(self.model, world, self.question)
        motions, likely = predict(self.gait.session, relative, np.arange(len(people)), levels)
        if plan.stepping is not None:
            joints = {role: card.skeleton.names.index(joint) for role, joint in card.roles.items()}
            for row, person in enumerate(people):
                stands, seed = plan.stepping.shares[row] ** 2, int(person.sway * 2**31)
                poses = motions.rotations[row], motions.root_position[row]
                swayed = holds.add_sway(*poses, joints, stands, rate, seed)
                motions.rotations[row], motions.root_position[row] = swayed
        return plan, (motions, likely)


def find_people(
    model: Synthesizer,
    gait: Gait,
    question: WalkQuestion,
    tracks: Sequence[Track],
    begin: float | None = None,
) -> TrackCrowd:
    """Return the people of tracks.

    question: of its fields, the frame rate, labels, takes, feet and seed count. begin: time of the
    first frame, s; that of the first sample by default.

    It is empty if all tracks are too short. Raises InvalidField for tracks that are too long.
    """
    question.check()
    walking_crowd.frame_count(1, 1.0, question.fps, question.seed)
    gait = gait.with_labels(question.labels)
    if begin is None:
        begin = min(float(track.times[0]) for track in tracks)
    people, skipped = [], {}
    poses = sum((track.times[-1] - track.times[0]) * question.fps + 1.0 for track in tracks)
    if poses > MAX_POSES:
        raise InvalidField("trajectories", f"{poses:.3g} poses, expected {MAX_POSES} at most")
    for track in tracks:
        cancellation.check()
        path = track_path.follow(track, begin, question.fps)
        if path is None:
            skipped[track.person] = f"shorter than two frames at {question.fps:g} frames a second"
            continue
        people.append(Person(track, path, *_draw(track.person, question.seed)))
    frames = max((person.path.first + len(person.path) for person in people), default=0)
    if frames > MOST_FRAMES:
        span = f"{frames} frames from the first sample to the last"
        raise InvalidField("trajectories", f"{span}, expected {MOST_FRAMES} at most")
    return TrackCrowd(model, gait, question, tuple(people), begin, frames, skipped)


def _draw(person: str, seed: int) -> tuple[float, float, float, float, int]:
    """Return the number, phase, sway, height and take of a person by the hash of the id."""
    person = re.sub(r"~\d+$", "", person)  # All legs of a person have the same looks.
    digest = hashlib.blake2b(f"{seed}:{person}".encode(), digest_size=40).digest()
    words = np.frombuffer(digest, "<u8")
    number, phase, sway, size = (words[:4] / 2.0**64).tolist()
    low, high = SIZES
    return number, phase, sway, low + (high - low) * size, 1 + int(words[4]) % (TAKES - 1)


def build_crowd(
    model: Synthesizer,
    gait: Gait,
    question: WalkQuestion,
    tracks: Sequence[Track],
) -> CrowdClip:
    """Return the crowd of people on tracks, on one clock; they are hidden outside of their tracks.

    Raises InvalidField as `find_people` does, and for tracks that are all too short.
    """
    return crowd_clip(find_people(model, gait, question, tracks))


def of_question(model: Synthesizer, question: WalkQuestion, tracks: TrackSet | None) -> CrowdClip:
    """Return the crowd of tracks, or on random paths if they are None. Raises as `build_crowd`."""
    if tracks is None:
        return walking_feet.build_crowd(model, model.gait, question)
    crowd = build_crowd(model, model.gait, question, tracks.tracks)
    skipped = {**tracks.skipped, **crowd.facts["skipped"]}
    return replace(crowd, facts={**crowd.facts, "skipped": skipped})


def crowd_clip(crowd: TrackCrowd) -> CrowdClip:
    """Return a crowd as a clip on one clock. Raises InvalidField for an empty one."""
    if not crowd.people:
        raise InvalidField("trajectories", "all shorter than two frames, expected longer ones")
    card = crowd.gait.session.card
    people, counts = crowd.people, [len(person.path) for person in crowd.people]
    first = np.array([person.path.first for person in people])
    presence = np.column_stack([first, first + counts])

    def batches() -> Iterator[Motions]:
        for group, _, motions in crowd.batches():
            yield from _on_clock(crowd, group, motions)

    points = np.array([person.path.points[0] for person in people])
    return CrowdClip(
        card.skeleton,
        crowd.question.fps,
        crowd.frames,
        Placement(floor_plane.at_height(points, np.zeros(len(points))), np.zeros(len(points))),
        np.arange(len(people)),
        batches(),
        crowd_facts(crowd),
        tuple(curve.name for curve in card.curves),
        presence,
    )


def _on_clock(crowd: TrackCrowd, people: Sequence[Person], motions: Motions) -> Iterator[Motions]:
    """Yield motions in the frames of the shared clock: before and after, a person keeps still.

    They are fewer at a time than those made together, as the clock may be much longer.
    """
    size = max(1, POSES_PER_BATCH // crowd.frames)
    for begin in range(0, len(people), size):
        rows = [
            np.clip(np.arange(crowd.frames) - person.path.first, 0, len(person.path) - 1)
            for person in people[begin : begin + size]
        ]
        some = np.arange(begin, begin + len(rows))
        index = some[:, None], np.stack(rows)
        feet = motions.feet
        yield Motions(
            motions.rotations[index],
            motions.root_position[index],
            motions.bone_offsets[some],
            motions.levels[index],
            None if motions.curves is None else motions.curves[index],
            feet and StandingFeet(*(getattr(feet, fact.name)[some] for fact in fields(feet))),
        )


def crowd_facts(crowd: TrackCrowd) -> dict[str, Any]:
    """Return the facts of a crowd: its people, how near they keep to their tracks, and limits."""
    card = crowd.gait.session.card
    combinations = crowd.gait.labels.draw(np.array([person.number for person in crowd.people]))
    errors = [person.path.errors for person in crowd.people]
    overlaps = _overlaps(crowd)
    return {
        "model": f"{card.name}@{crowd.gait.session.digest}",
        **crowd.gait.labels.facts(combinations),
        **walking_feet.facts_of(card, crowd.question),
        "people": [person.track.person for person in crowd.people],
        "begin": crowd.begin,
        "scales": [round(person.scale, 4) for person in crowd.people],
        "path_error_cm": {
            "mean": round(100.0 * float(np.concatenate(errors).mean()), 2),
            "worst": round(100.0 * float(max(error.max() for error in errors)), 2),
        },
        "skipped": crowd.skipped,
        **overlaps,
        "warnings": [
            *overlaps.get("warnings", ()),
            *(limit.text for limit in crowd.limits),
        ],
    }


def left_out(skipped: Mapping[str, str]) -> list[str]:
    """Return a line for each person who was left out, with the reason."""
    return [f"person {person!r} left out: {why}" for person, why in skipped.items()]


def shorten(lines: Sequence[str]) -> list[str]:
    """Return the first lines about people, which are the worst, and how many more there are."""
    more = len(lines) - MOST_LINES
    return [*lines[:MOST_LINES], *([f"and {more} more"] if more > 0 else [])]


def _overlaps(crowd: TrackCrowd) -> dict[str, Any]:
    """Return the facts of people who overlap; none for more than can be searched."""
    count, rate = len(crowd.people), crowd.question.fps
    if not collision_avoidance.is_searchable(count, crowd.frames, rate):
        return {}
    # Who is not there is far away from all others.
    away = 1e7 * (1.0 + np.arange(count))
    points = np.tile(away[:, None], crowd.frames).astype(np.complex128)
    for row, person in zip(points, crowd.people, strict=True):
        row[person.path.first : person.path.first + len(person.path)] = person.path.points
    names = [person.track.person for person in crowd.people]
    return walking_crowd.overlap_facts(points, rate, names)


def _limits(crowd: TrackCrowd, person: Person) -> Iterator[PersonLimit]:
    """Yield what a walker cannot do as the track does, with the time, and what it does instead."""
    path, rate = person.path, crowd.question.fps
    steps = np.diff(person.track.times)
    late = int(np.argmax(steps))
    excess = float(steps[late] / max(LONG_STEP, STEPS * np.median(steps)))
    if excess > 1.0:
        line = f"person {person.track.person!r} at {person.track.times[late]:.2f} s: no sample for "
        yield PersonLimit(excess, f"{line}{steps[late]:.1f} s, and goes straight to the next one")
    speeds = np.abs(path.velocities)
    checks = [
        (speeds / MOST_SPEED, "{:.1f} m/s, faster than a walk: its feet slide", MOST_SPEED),
        (path.errors / FAR, "the path is left by {:.2f} m, which no walker can follow", FAR),
    ]
    if person.track.headings is not None:
        times = crowd.begin + (path.first + np.arange(len(path))) / rate
        stated = np.exp(1j * np.interp(times, person.track.times, np.unwrap(person.track.headings)))
        aside = np.abs(np.angle(stated * np.exp(-1j * path.headings)))
        degrees = float(np.degrees(ASIDE))
        sentence = "faces the way it goes, {:.0f} degrees from its heading"
        checks.append((aside / ASIDE, sentence, degrees))
    for values, sentence, unit in checks:
        at = int(np.argmax(values))
        if values[at] > 1.0:
            time = crowd.begin + (path.first + at) / rate
            text = sentence.format(values[at] * unit)
            line = f"person {person.track.person!r} at {time:.2f} s: {text}"
            yield PersonLimit(float(values[at]), line)
