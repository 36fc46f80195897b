"""People on trajectories: pelvises, feet, headings and accelerations; and random paths of scripts.

python benchmarks/tracks.py --record
python benchmarks/tracks.py --strip PICTURE.png

Tracks are drawn at 10 Hz: they walk straight, in a circle, stop, stand, turn back on the spot, take
a corner in a curve of 0.6 m, go to the side and backwards, each as 8 people. Peaks of all kinds are
those of all performers with 5 takes each. Corners of 90 degrees at constant speed, speeds from 0 to
2 m/s and people who creep or tremble have figures of their own.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from performance_costs import Figure
from rows import Row, record, table

from posefield.common.errors import MotionError
from posefield.locomotion import floor_plane, walking_crowd
from posefield.model import load, perform
from posefield.model_file.model_card import mean_accelerations
from posefield.motion import quat, skeleton
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis.synthesizer import Synthesizer
from posefield.tracks import track, track_crowd
from posefield.tracks.track import Track

ROOT = Path(__file__).parents[1]
RATE, COPIES, PATHS = 60.0, 8, 40
STEP = 0.1
TAKES, CORNERS = 5, (1.0, 1.3, 1.6)
"""Takes of each performer whose peaks are measured, and speeds of sharp corners, m/s."""
Kinds = dict[str, tuple[np.ndarray, np.ndarray, np.ndarray | None]]
CHANGES = ("stop", "turn on the spot", "corner", "to the side", "backwards")
ROLLING = 9
"""Frames at each end of a contact in which a foot rolls, and its ball moves."""


def along(distance: Callable[[float], float], seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and points of a straight track."""
    times = np.arange(0.0, seconds + 1e-9, STEP)
    return times, np.array([(distance(time), 0.0) for time in times])


def ramp(time: float, begin: float, end: float, speed: float) -> float:
    """Return the distance of a walk from standing to standing, each in one second."""
    gone = min(max(time - begin, 0.0), end - begin)
    steady = end - begin - 2.0
    rise, even, fall = (
        min(gone, 1.0),
        min(max(gone - 1.0, 0.0), steady),
        max(gone - 1.0 - steady, 0),
    )
    return speed * (0.5 * rise**2 + even + fall - 0.5 * fall**2)


def corner(time: float) -> tuple[float, float]:
    """Return the point of a walk round a corner in a quarter of a circle."""
    radius, gone = 0.6, 1.1 * time - 3.0
    angle = min(max(gone / radius, 0.0), np.pi / 2)
    beyond = max(gone - radius * np.pi / 2, 0.0)
    return 3.0 + min(gone, 0.0) + radius * np.sin(angle), radius * (1 - np.cos(angle)) + beyond


def cases() -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray | None]]:
    """Return times, points east and north, and angles of each kind of track."""
    times = np.arange(0.0, 8.0 + 1e-9, STEP)
    circle = 3.0 * np.column_stack([np.sin(1.1 * times / 3.0), 1.0 - np.cos(1.1 * times / 3.0)])
    bend = np.array([corner(time) for time in times[times <= 6.5]])
    aside = along(lambda time: 0.4 * min(max(time - 1.0, 0.0), 4.0), 7.0)
    quarter, half = (np.full(len(aside[0]), angle) for angle in (np.pi / 2, np.pi))
    straight = {
        f"straight, {speed:g} m/s": along(lambda time, speed=speed: speed * time, 8.0)
        for speed in (0.3, 0.8, 1.3, 1.9)
    }
    return {
        **{name: (*walk, None) for name, walk in straight.items()},
        "circle": (times, circle, None),
        "stop": (*along(lambda t: ramp(t, 0.5, 5.0, 1.2) + ramp(t, 8.0, 12.0, 1.2), 13.0), None),
        "stand": (*along(lambda time: 0.0, 8.0), None),
        "turn on the spot": (
            *along(lambda t: ramp(t, 0.5, 4.5, 1.1) - ramp(t, 6.5, 10.0, 1.1), 11.0),
            None,
        ),
        "corner": (times[times <= 6.5], bend, None),
        "to the side": (*aside, quarter),
        "backwards": (*aside, half),
    }


@dataclass(frozen=True)
class Walked:
    """Motion of a person: joints (F, J, 3), m, headings of the root (F,), rad, phases (F,) without
    wrapping, whether each foot stands (F, 2), the track's points and velocities (F,)."""

    name: str
    joints: np.ndarray
    headings: np.ndarray
    phases: np.ndarray
    stands: np.ndarray
    points: np.ndarray
    velocities: np.ndarray


def walk(model: Synthesizer, kinds: Kinds, copies: int = COPIES, takes: int = 0) -> list[Walked]:
    """Return the motions of some people on each track; takes: of each performer, 0 for no take."""
    people, performers = [], len(model.gait.labels.weights) - 1
    copies = takes * performers or copies
    for name, (times, points, angles) in kinds.items():
        faced = None if angles is None else track.floor_headings(angles)
        walked = track.floor_points(*points.T)
        people += [track.Track(f"{name}#{i}", times, walked, faced) for i in range(copies)]
    order = WalkQuestion(count=len(people), fps=RATE, take="index" if takes else 0)
    crowd = track_crowd.find_people(model, model.gait, order, people)
    if takes:
        persons = [
            replace(person, number=(index % performers + 0.5) / performers)
            for index, person in enumerate(crowd.people)
        ]
        crowd = replace(crowd, people=tuple(persons))
    card, done = crowd.gait.session.card, []
    for group, plan, motions in crowd.batches():
        levels = walking_crowd.build_schedule(model, plan, order)
        _, likely = walking_crowd.motions_with_contacts(
            crowd.gait.session, plan, np.arange(len(group)), levels
        )
        for index, person in enumerate(group):
            rows = slice(0, len(person.path))
            rotations = motions.rotations[index, rows].astype(float)
            roots = motions.root_position[index, rows].astype(float)
            start = floor_plane.at_height(person.path.points[:1], np.zeros(1))
            local = skeleton.translations(motions.bone_offsets[index].astype(float), roots + start)
            joints = skeleton.positions(card.skeleton.parents, rotations, local)
            facing = floor_plane.project(quat.rotate(rotations[:, 0], np.array([0.0, 0.0, 1.0])))
            exact, velocities = followed(person.track, person.path.first, len(joints))
            done.append(
                Walked(
                    person.track.person.partition("#")[0],
                    joints,
                    np.unwrap(np.angle(facing)),
                    np.unwrap(plan.phases[index, rows], period=1.0),
                    likely[index, rows] > 0.9,
                    exact,
                    velocities,
                )
            )
    return done


def followed(person: Track, first: int, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the points and the velocities of a track at its frames: straight between samples."""
    times = (first + np.arange(frames)) / RATE
    points = np.interp(times, person.times, person.points)
    wide = np.interp(times + STEP, person.times, person.points)
    return points, (wide - np.interp(times - STEP, person.times, person.points)) / (2.0 * STEP)


def facing_errors(walked: Walked) -> np.ndarray:
    """Return angles, degrees, of the heading from the direction of travel, means over a cycle."""
    fast = np.abs(walked.velocities) > 0.5
    travel = np.unwrap(np.angle(np.where(fast, walked.velocities, 1.0)))
    errors = []
    for begin in range(len(fast)):
        end = int(np.searchsorted(walked.phases, walked.phases[begin] + 1.0))
        if end < len(fast) and fast[begin:end].all():
            errors.append((walked.headings - travel)[begin:end].mean())
    return np.degrees(np.abs((np.array(errors) + np.pi) % (2.0 * np.pi) - np.pi))


def stance_speeds(walked: Walked, feet: Sequence[int]) -> np.ndarray:
    """Return the mean speed of the ball of each foot over each stance, cm/s.

    A stance is a contact without the frames at its ends in which the heel comes down or rises.
    """
    speeds = []
    for foot, joint in enumerate(feet):
        steps = np.linalg.norm(np.diff(walked.joints[:, joint][:, [0, 2]], axis=0), axis=-1)
        edges = np.flatnonzero(np.diff(walked.stands[:, foot], prepend=False, append=False))
        for begin, end in edges.reshape(-1, 2):
            if end - begin > 2 * ROLLING:
                speeds.append(100.0 * RATE * steps[begin + ROLLING : end - ROLLING].mean())
    return np.array(speeds)


def track_rows(model: Synthesizer) -> list[Row]:
    """Return how people follow tracks."""
    done, card = walk(model, cases()), model.session.card
    times = np.concatenate([times for times, *_ in cases().values()])
    stamps = 1e6 * float(np.abs(np.round(times * RATE) / RATE - times).max())
    away = {one.name: [] for one in done}
    for one in done:
        away[one.name].append(np.abs(floor_plane.project(one.joints[:, 0]) - one.points))
    means = {name: 100.0 * np.concatenate(errors).mean() for name, errors in away.items()}
    worsts = {name: 100.0 * np.concatenate(errors).max() for name, errors in away.items()}
    facing = np.concatenate(
        [facing_errors(one) for one in done if one.name not in ("to the side", "backwards")]
    )
    slides = np.concatenate([stance_speeds(one, card.feet) for one in done])
    captured = card.captured_acceleration.p99 if card.captured_acceleration else np.nan
    changes = {name: cases()[name] for name in CHANGES} | corners()
    taken = walk(model, changes, takes=TAKES)
    peaks = {name: np.array([]) for name in changes}
    for one in taken:
        peak = mean_accelerations(one.joints, RATE).max() / captured
        peaks[one.name] = np.append(peaks[one.name], peak)
    every = np.concatenate(list(peaks.values()))
    worst = max(peaks, key=lambda name: peaks[name].max())
    low = 100.0 * min(one.joints[..., 1].min() for one in done)
    mean_of = max(means, key=means.__getitem__)
    worst_of = max(worsts, key=worsts.__getitem__)
    return [
        Figure(
            "pelvis from track, mean",
            max(means.values()),
            "cm",
            f"of the worst kind: {mean_of}; all: {np.mean([*means.values()]):.2g}; sway of the "
            "pelvis is in it",
            None,
            3.0,
            1.0,
        ),
        Figure("pelvis from track, worst", max(worsts.values()), "cm", worst_of, None, 8.0, 3.0),
        Figure("time stamps from frames", stamps, "µs", "samples at 10 Hz", None, 0.001),
        Figure(
            "feet while standing",
            float(slides.mean()),
            "cm/s",
            f"mean of {len(slides)} contacts without 0.15 s at both ends, in which feet roll; 99th "
            f"percentile {np.percentile(slides, 99):.2g}, worst {slides.max():.2g}",
            None,
            1.5,
            0.5,
        ),
        Figure("below the floor", max(-low, 0.0), "cm", f"lowest joint {low:.2g} cm", None, 0.0),
        Figure(
            "heading from direction of travel",
            float(np.percentile(facing, 99)),
            "°",
            f"99th percentile of means over a cycle above 0.5 m/s; worst {facing.max():.2g}",
            None,
            5.0,
            2.0,
        ),
        Figure(
            "peaks of starts, stops and turns over captured",
            float(every.max()),
            "times",
            f"{worst}; {len(every)} people, {TAKES} takes of each performer; median "
            f"{np.median(every):.2g}, 95th percentile {np.percentile(every, 95):.2g}, 99th "
            f"{np.percentile(every, 99):.2g}; "
            + ", ".join(f"{name} {values.max():.2g}" for name, values in peaks.items()),
            None,
            1.5,
            1.2,
        ),
        *corner_rows(taken),
        *speed_rows(model),
        *still_rows(model),
    ]


def corners() -> Kinds:
    """Return tracks with a corner of 90 degrees at constant speed."""
    times = np.arange(0.0, 8.0 + 1e-9, STEP)
    tracks: Kinds = {}
    for speed in CORNERS:
        gone = speed * times - 3.0
        points = np.column_stack([np.minimum(gone, 0.0), np.maximum(gone, 0.0)])
        tracks[f"sharp corner at {speed:g} m/s"] = (times, points, None)
    return tracks


def corner_rows(done: Sequence[Walked]) -> list[Row]:
    """Return how far people are from tracks with sharp corners at constant speed."""
    rows = []
    for name in corners():
        errors = [100.0 * from_track(one) for one in done if one.name == name]
        mean = np.concatenate(errors).mean()
        note = f"mean {mean:.2g} cm; sway of the pelvis is in it, takes too; time stamps are kept"
        worst = float(max(error.max() for error in errors))
        rows.append(Figure(f"pelvis from track, {name}, worst", worst, "cm", note, None, 8.0, 3.0))
    return rows


def from_track(walked: Walked) -> np.ndarray:
    """Return the distances (F,) of the pelvis from its track, m."""
    return np.abs(floor_plane.project(walked.joints[:, 0]) - walked.points)


def speed_rows(model: Synthesizer) -> list[Row]:
    """Return what people do on straight tracks of 0 to 2 m/s, in steps of 0.1 m/s."""
    speeds = np.arange(21) / 10.0
    kinds: Kinds = {
        f"{speed:g}": (*along(lambda time, speed=speed: speed * time, 12.0), None)
        for speed in speeds
    }
    done, feet = walk(model, kinds, copies=4), model.session.card.feet
    skates, paths, facing = [], [], []
    for name in kinds:
        some = [one for one in done if one.name == name]
        skates.append(np.concatenate([stance_speeds(one, feet) for one in some]).mean())
        paths.append(100.0 * max(from_track(one).max() for one in some))
        errors = np.concatenate([facing_errors(one) for one in some])
        facing.append(np.percentile(errors, 99) if len(errors) else 0.0)
    columns = [
        ("feet while standing", skates, "cm/s", 1.5, 0.5),
        ("pelvis from track", paths, "cm", 8.0, 3.0),
        ("heading from direction of travel", facing, "°", 5.0, 2.0),
    ]
    return [
        Figure(
            f"straight at 0 to 2 m/s: {name}, worst speed",
            float(max(values)),
            unit,
            "by 0.1 m/s: " + " ".join(f"{value:.1f}" for value in values),
            None,
            must,
            wish,
        )
        for name, values, unit, must, wish in columns
    ]


def still_rows(model: Synthesizer) -> list[Row]:
    """Return how often people step who stand, tremble, or creep."""
    times = np.arange(0.0, 20.0, STEP)
    still = np.zeros((len(times), 2))
    kinds: Kinds = {
        "standing": (times, still, None),
        "noise of 3 cm": (times, np.random.default_rng(0).normal(0.0, 0.03, still.shape), None),
        "noise of 5 cm": (times, np.random.default_rng(0).normal(0.0, 0.05, still.shape), None),
        "0.02 m/s": (times, still + 0.02 * times[:, None] * (1.0, 0.0), None),
    }
    cycles = {name: np.array([]) for name in kinds}
    for one in walk(model, kinds):
        cycles[one.name] = np.append(cycles[one.name], one.phases[-1] - one.phases[0])
    note = "; ".join(f"{name} {2.0 * values.mean():.2g}" for name, values in cycles.items())
    title = "steps in 20 s of a person at rest with noise of 3 cm at 10 Hz"
    steps = 2.0 * float(cycles["noise of 3 cm"].mean())
    return [Figure(title, steps, "steps", note, None, 10.0, 4.0)]


def path_rows() -> list[Row]:
    """Return how many random paths of three points are walked within 1.5 times their length."""
    rng, good, longest = np.random.default_rng(0), 0, 0.0
    for _ in range(PATHS):
        steps = np.column_stack([rng.uniform(-3.0, 3.0, 3), rng.uniform(1.5, 4.0, 3)])
        points = np.cumsum(steps, axis=0)
        walk = {"kind": "walk", "model": "cmu_walk", "along": points.tolist(), "speed": 1.1}
        script = {"segments": [{**walk, "start": "standing", "stop": "standing"}]}
        try:
            roots = perform(script).clip.root_path[:, [0, 2]]
        except MotionError as error:
            print(error)
            continue
        # Without the sway of the pelvis: a place each half second.
        gone = np.linalg.norm(np.diff(roots[::15], axis=0), axis=1).sum()
        share = gone / np.linalg.norm(steps, axis=1).sum()
        arrived = np.linalg.norm(roots[-1] - points[-1]) < 0.3
        good, longest = good + int(share < 1.5 and arrived), max(longest, share)
    note = f"of {PATHS}, standing at both ends; longest {longest:.2f} times its length"
    return [
        Figure(
            "random paths of three points not walked", PATHS - good, "paths", note, None, 2.0, 0.0
        )
    ]


def strip(picture: Path) -> None:
    """Draw a corner, a stop and a turn on the spot as strips of figures, left limbs red."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    model = load("cmu_walk").synthesizer
    names = model.session.card.skeleton.names
    parents = model.session.card.skeleton.parents
    done = {one.name: one for one in reversed(walk(model, cases()))}
    kinds = ("corner", "stop", "turn on the spot", "to the side")
    figure, rows = plt.subplots(len(kinds), figsize=(14, 2.2 * len(kinds)))
    for axes, kind in zip(rows, kinds, strict=True):
        joints = done[kind].joints
        for index, frame in enumerate(np.linspace(0, len(joints) - 1, 20).astype(int)):
            pose = joints[frame] - joints[frame, 0] * (1.0, 0.0, 1.0)
            across = pose[:, 0] * np.cos(0.6) + pose[:, 2] * np.sin(0.6) + 0.9 * index
            for joint, parent in enumerate(parents):
                if parent >= 0:
                    side = {"L": "C3", "R": "C0"}.get(names[joint][0], "0.2")
                    pair = [joint, parent]
                    axes.plot(across[pair], pose[pair, 1], color=side, linewidth=2)
            axes.text(0.9 * index, 1.75, f"{frame / RATE:.1f}", fontsize=7, ha="center")
        axes.axhline(0.0, color="0.8", linewidth=0.5)
        axes.set_title(kind, loc="left", fontsize=9)
        axes.set_aspect("equal")
        axes.axis("off")
    figure.tight_layout()
    figure.savefig(picture, dpi=70)


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--strip", type=Path, help="draw a picture instead")
    options = parser.parse_args(arguments)
    if options.strip:
        strip(options.strip)
        return
    rows = [*track_rows(load("cmu_walk").synthesizer), *path_rows()]
    print(table(rows))
    if options.record:
        record({"tracks": rows}, "python benchmarks/tracks.py --record", ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
