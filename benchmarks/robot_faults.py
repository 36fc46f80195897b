"""Broken gaits of a robot planted among good ones: how many the doctor finds, and false alarms.

    python examples/biped_gaits.py build/biped
    python benchmarks/robot_faults.py build/data/robot_go_bdx build/biped --record

Four gaits of the folder are broken at a time, each in another way: one joint of each, at random,
where that changes its angle by a degree or more (root mean square). Gaits that are told without a
fault count as false alarms, all of them.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rows import Row, record, table

from posefield.robots import robot_formats
from posefield.robots.file_conventions import Conventions
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import RobotMotion
from posefield_train.robots import doctor, robot_file

Numbers = NDArray[np.float64]
TRIALS, AT_ONCE, LEAST = 12, 4, np.radians(1.0)
"""Gaits that are broken in each way and at a time, and the least change of an angle, rad."""
RESULTS = Path(__file__).parents[1] / "docs/results"


def late(angles: Numbers, rng: np.random.Generator) -> Numbers:
    """Return angles a quarter of a cycle later, by the strongest frequency of the joint."""
    spectrum = np.abs(np.fft.rfft(angles - angles.mean()))
    return np.roll(angles, round(len(angles) / max(int(spectrum.argmax()), 1) / 4))


def step(angles: Numbers, rng: np.random.Generator) -> Numbers:
    """Return angles that step by 15 degrees at a frame."""
    frame = rng.integers(len(angles) // 4, 3 * len(angles) // 4)
    return angles + np.radians(15.0) * (np.arange(len(angles)) >= frame)


Fault = Callable[[Numbers, np.random.Generator], Numbers]
FAULTS: dict[str, Fault] = {
    "offset of 10 degrees": lambda angles, rng: angles + np.radians(10.0) * rng.choice([-1, 1]),
    "noise of 3 degrees": lambda angles, rng: (
        angles + np.radians(3.0) * rng.normal(size=len(angles))
    ),
    "step of 15 degrees": step,
    "a quarter of a cycle late": late,
    "scaled by 1.5": lambda angles, rng: 1.5 * angles,
    "scaled by 2/3": lambda angles, rng: angles / 1.5,
    "sign changed": lambda angles, rng: -angles,
    "still": lambda angles, rng: np.full_like(angles, angles.mean()),
}
EXCHANGED = "exchanged with another joint"


def read(folder: Path) -> tuple[Robot, list[RobotMotion]]:
    """Return the robot of a folder and its gaits."""
    robot = robot_file.read(next(folder.glob("*.xml")))
    paths = sorted((folder / "gaits").glob("*.json"))
    return robot, [robot_formats.read(path, Conventions(robot)) for path in paths]


def broken(motion: RobotMotion, kind: str, rng: np.random.Generator) -> RobotMotion | None:
    """Return a motion with a fault of one joint; None where that changes next to nothing."""
    angles = motion.angles.copy()
    hinge, other = rng.choice(angles.shape[1], 2, replace=False)
    if kind == EXCHANGED:
        angles[:, [hinge, other]] = angles[:, [other, hinge]]
    else:
        angles[:, hinge] = FAULTS[kind](angles[:, hinge], rng)
    change = np.sqrt(((angles - motion.angles) ** 2).mean(axis=0)).max()
    return replace(motion, angles=angles) if change >= LEAST else None


def measure(folder: Path, with_robot: bool) -> list[Row]:
    """Return the share of broken gaits that are missed, by kind, and of good ones that are told."""
    robot, motions = read(folder)
    rng = np.random.default_rng(0)
    kinds = [kind for kind in (*FAULTS, EXCHANGED) for _ in range(TRIALS)]
    rng.shuffle(kinds)
    missed: dict[str, list[bool]] = {kind: [] for kind in sorted(set(kinds))}
    false: list[float] = []
    for start in range(0, len(kinds), AT_ONCE):
        planted, places = list(motions), rng.permutation(len(motions)).tolist()
        faults: dict[int, str] = {}
        for kind in kinds[start : start + AT_ONCE]:
            fault = None
            while fault is None:
                place = places.pop()
                fault = broken(motions[place], kind, rng)
            planted[place], faults[place] = fault, kind
        outliers = doctor.outliers(planted, robot if with_robot else None)
        for place, kind in faults.items():
            missed[kind].append(place not in outliers)
        sound = [index for index in range(len(motions)) if index not in faults]
        false.append(float(np.mean([index in outliers for index in sound])))
        sys.stderr.write(f"{start + AT_ONCE} of {len(kinds)}\n")
    everything = [each for kind in missed.values() for each in kind]
    name = f"{robot.name.removesuffix('.xml')}, {'with robot' if with_robot else 'joints alone'}"
    goals = (5.0, 2.0) if with_robot else (None, None)
    about = f"{sum(everything)} of {len(everything)}"
    told = f"{100 * np.mean(false) * len(motions) / 100:.1f} of {len(motions)}"
    return [
        Row(f"{name}: broken, missed", 100 * np.mean(everything), "%", about, None, goals[0]),
        Row(f"{name}: good, told", 100 * np.mean(false), "%", told, None, goals[1]),
        *(
            Row(
                f"{name}: {kind}, missed",
                100 * np.mean(each),
                "%",
                f"{sum(each)} of {len(each)}",
                None,
                None,
            )
            for kind, each in missed.items()
        ),
    ]


def main() -> None:
    """Measure, and print or record the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+", help="folders with a robot and gaits")
    parser.add_argument(
        "--record", action="store_true", help="write docs/results/robot_faults.json"
    )
    options = parser.parse_args()
    rows = [
        row for path in options.folders for known in (True, False) for row in measure(path, known)
    ]
    sys.stdout.write(f"{table(rows)}\n")
    if options.record:
        record(
            {"robot_faults": rows}, "python benchmarks/robot_faults.py FOLDERS --record", RESULTS
        )


if __name__ == "__main__":
    main()
