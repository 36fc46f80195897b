"""Measure the cost of crowds on tracks: 1,000 people for a minute, and 10,000 for ten minutes.

python benchmarks/track_costs.py --record
python benchmarks/track_costs.py --parts FOLDER --record

Each command runs as a process of its own, whose CPU seconds and peak memory the system counts. CPU
seconds grow where other programs use the caches: a fixed loop is timed meanwhile, and its median
over its quickest time is told. Parts are made until some are there, the process is killed by
SIGKILL, and the same command resumes until some more are there; four parts, those around the kill
among them, are then made afresh in another folder, and their bytes compared. A folder with parts is
continued.
"""

import argparse
import filecmp
import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from osi3.osi_groundtruth_pb2 import GroundTruth
from performance_costs import Figure
from rows import Row, record, table

from posefield.batch import track_parts
from posefield.cli import crowd_files
from posefield.motion import quat
from posefield.question.walk_question import WalkQuestion
from posefield.registry import model_registry
from posefield.tracks.track_files import DEFAULT_READING

ROOT = Path(__file__).parents[1]
PEOPLE, SECONDS, RATE = 1_000, 60.0, 30.0
CITY, CITY_SECONDS, CITY_RATE, PART = 10_000, 600.0, 1.0, 100
PAUSE = 2.0
"""Seconds between two timings of the fixed loop."""


@dataclass(frozen=True)
class Cost:
    """CPU seconds of a process, its peak memory in MB, and the slowness of the machine."""

    seconds: float
    memory: float
    slowness: float


def write_tracks(path: Path, people: int, seconds: float, step: float) -> None:
    """Write people who walk along bends, of whom each third stands once, in the order of time."""
    rng, times = np.random.default_rng(0), np.arange(0.0, seconds + 1e-9, step)[:, None]
    area = 50.0 * np.sqrt(people)
    starts, speeds = rng.uniform(0.0, area, (2, people)), rng.uniform(0.6, 1.7, people)
    ways, bends = rng.uniform(0.0, 2.0 * np.pi, people), rng.uniform(3.0, 18.0, people)
    angles = ways + 0.8 * np.sin(bends / seconds * times)
    apart = np.abs(times - rng.uniform(0.2, 0.8, people) * seconds)
    paces = speeds * np.where(np.arange(people) % 3, 1.0, np.clip(apart / 2.0 - 1.0, 0.0, 1.0))
    x, y = (
        start + np.cumsum(step * paces * way(angles), axis=0)
        for start, way in zip(starts, (np.cos, np.sin), strict=True)
    )
    with path.open("w") as file:
        file.write("time,id,x,y\n")
        for row in zip(times[:, 0], x, y, strict=True):
            points = enumerate(zip(row[1], row[2], strict=True))
            file.writelines(
                f"{row[0]:g},p{person},{east:.3f},{north:.3f}\n" for person, (east, north) in points
            )


def run(words: Sequence[str], stop: Callable[[], bool] = lambda: False) -> Cost:
    """Run `posefield` with some words; kill it when `stop` says so."""
    command = [sys.executable, "-m", "posefield", "crowd", "cmu_walk", *words]
    turns, loops = np.random.default_rng(0).normal(size=(2, 30_000, 4)), []
    # A user's second run finds compiled modules; here an environment may forbid to write them.
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": ""}
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, env=environment) as running:
        while True:
            number, status, usage = os.wait4(running.pid, os.WNOHANG)
            if number:
                break
            began = time.thread_time()
            quat.mul(*turns)
            loops.append(time.thread_time() - began)
            if stop():
                running.send_signal(signal.SIGKILL)
            time.sleep(PAUSE)
        running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode not in (0, -signal.SIGKILL):
        raise RuntimeError(f"{command} ended with {running.returncode}")
    slowness = float(np.median(loops) / min(loops))
    return Cost(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0, slowness)


def file_rows() -> Iterator[Row]:
    """Yield the costs of files of a minute."""
    with TemporaryDirectory() as name:
        tracks = Path(name, "tracks.csv")
        write_tracks(tracks, PEOPLE, SECONDS, 0.1)
        for endings in (("usd",), ("osi",), ("usd", "osi")):
            outputs = [Path(name, f"{'-'.join(endings)}.{ending}") for ending in endings]
            words = [word for output in outputs for word in ("-o", str(output))]
            cost = run(["--trajectories", str(tracks), "--fps", f"{RATE:g}", *words])
            title = f"{PEOPLE:,} people for {SECONDS:g} s to {' and '.join(endings).upper()}"
            note = (
                f"at {RATE:g} frames a second; other programs slowed a fixed loop by "
                f"{cost.slowness:.2f} meanwhile, {os.getloadavg()[2]:.1f} ran on 2 cores"
            )
            yield Figure(f"{title}: CPU", cost.seconds, "s", note, None, 60.0, 25.0)
            yield Figure(f"{title}: peak memory", cost.memory, "MB", "", None, 1000.0, 500.0)
            for output in outputs:
                if endings == ("osi",):
                    error, count = velocity_error(output)
                    text = "velocities in OSI from central differences"
                    yield Figure(text, error, "%", f"of {count:,} bones", None, 1.0, 0.2)
                output.unlink()


def velocity_error(path: Path) -> tuple[float, int]:
    """Return the error, % of the speeds, of the first velocities of a trace, and their number."""
    frames = []
    with path.open("rb") as file:
        for _ in range(30):
            (size,) = struct.unpack("<I", file.read(4))
            people = GroundTruth.FromString(file.read(size)).moving_object[:50]
            skeletons = [person.pedestrian_attributes.skeleton_bone for person in people]
            frames.append([[vectors(bone) for bone in bones] for bones in skeletons])
    places, velocities = np.moveaxis(np.array(frames), -2, 0)
    differences = 0.5 * RATE * (places[2:] - places[:-2])
    error = np.linalg.norm(velocities[1:-1] - differences) / np.linalg.norm(differences)
    return 100.0 * float(error), differences[..., 0].size


def vectors(bone: Any) -> list[list[float]]:
    """Return the position and the velocity of a bone."""
    return [[value.x, value.y, value.z] for value in (bone.position, bone.velocity)]


def parts_rows(folder: Path, stops: Sequence[int]) -> list[Row]:
    """Return the memory of parts, and how many of those compared differ after a kill.

    stops: numbers of parts with which the process is killed, and ends.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tracks, output = folder / "city.csv", folder / "city.arrow"
    if not tracks.exists():
        write_tracks(tracks, CITY, CITY_SECONDS, 2.0)
    words = ["--trajectories", str(tracks), "--fps", f"{CITY_RATE:g}", "--take", "index"]
    words += ["--people-per-file", str(PART), "-o", str(output)]
    total = CITY // PART

    def made() -> int:
        return len(list((folder / "city").glob("?????.json")))

    part = folder / "part.csv"
    write_tracks(part, PART, CITY_SECONDS, 2.0)
    killed = run(words, lambda: made() >= stops[0])
    last = made()
    resumed = run(words, lambda: made() >= stops[1] < total)
    again = folder / "again"
    chosen = [0, last - 1, last, made() - 1]
    question = WalkQuestion(fps=CITY_RATE, take="index")
    model = model_registry.file_or_shipped(Path("cmu_walk"))
    job = crowd_files.parts_job(
        model, tracks, [again / "city.arrow"], PART, question, DEFAULT_READING, False
    )
    track_parts.write(
        job, lambda make, tasks, _: map(make, (t for t in tasks if t[1].index in chosen))
    )
    names = [f"{index:05}.arrow" for index in chosen]
    pairs = [(folder / "city" / name, again / "city" / name) for name in names]
    differ = sum(not filecmp.cmp(*pair, shallow=False) for pair in pairs)
    title = f"{CITY:,} people for {CITY_SECONDS:g} s in parts of {PART}"
    note = (
        f"{made()} of {total} parts, at {CITY_RATE:g} frame a second to Arrow, with takes; killed "
        f"with {last} parts, and resumed: {killed.memory:.0f} and {resumed.memory:.0f} MB"
    )
    compared = f"of {len(chosen)} made afresh: the first, those before and after the kill, the last"
    memory = max(killed.memory, resumed.memory)
    words[1], words[3], words[-1] = str(part), f"{RATE:g}", str(folder / "part.arrow")
    quick = run(words).memory
    return [
        Figure(f"{title}: peak memory", memory, "MB", note, None, 1500.0),
        Figure(
            f"a part of {PART} such people at {RATE:g} frames a second: peak memory",
            quick,
            "MB",
            "",
            None,
            1500.0,
        ),
        Figure(f"{title}: parts that differ after a kill", differ, "parts", compared, None, 0.0),
    ]


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--parts", type=Path, help="folder of the parts, 10 GB, instead of files")
    parser.add_argument("--stops", type=int, nargs=2, default=(50, 100), metavar="PARTS")
    options = parser.parse_args(arguments)
    parts, stops = options.parts, options.stops
    rows = parts_rows(parts, stops) if parts else list(file_rows())
    print(table(rows))
    if options.record:
        chosen = f"--parts FOLDER --stops {stops[0]} {stops[1]} " if parts else ""
        name, words = "track_parts" if parts else "track_costs", chosen
        command = f"python benchmarks/track_costs.py {words}--record"
        record({name: rows}, command, ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
