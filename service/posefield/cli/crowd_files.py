"""The `crowd` command: writes a walking crowd of a model to a file and reports on it."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from posefield.batch import process_pool, track_parts
from posefield.batch.track_parts import PartsJob
from posefield.common.errors import FileError, InvalidField
from posefield.common.units import Floats
from posefield.console.options import open_model
from posefield.console.output import counted
from posefield.console.progress import ProgressBar
from posefield.encode import crowd_formats
from posefield.locomotion import walking_crowd
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import Route
from posefield.motion.clip import CrowdClip, Motions, StandingFeet
from posefield.question import json_decoding
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis.synthesizer import Synthesizer
from posefield.tracks import track_crowd
from posefield.tracks.track import TrackSet
from posefield.tracks.track_files import TrackReading


def write_crowd(
    model: Synthesizer,
    question: WalkQuestion,
    outputs: list[Path],
    tracks: TrackSet | None = None,
) -> dict[str, Any]:
    """Write a crowd to files, and return its report as plain values.

    tracks: that its people follow; None for random paths. Raises InvalidField for an invalid query
    or extension, and FileError if a file cannot be written.
    """
    crowd_formats.endings_of(outputs, question)
    crowd = track_crowd.of_question(model, question, tracks)
    feet = _FootSkateMeter(model.gait, question.fps)
    watched = _with_progress(crowd, question.motions or len(crowd.motion), feet)
    crowd_formats.write_files(watched, outputs, question, model.session.card.roles)
    return {
        "file": str(outputs[0]),
        "files": [str(output) for output in outputs],
        "characters": len(crowd.motion),
        "motions": question.motions or len(crowd.motion),
        "frames": crowd.frames,
        "rate": crowd.rate,
        "seed": question.seed,
        "feet_stand": None,
        "take": {},
        "overlaps": {},
        "warnings": [],
        **crowd.facts,
        **feet.facts(),
    }


def parts_job(
    model: Path,
    tracks: Path,
    outputs: list[Path],
    people: int,
    question: WalkQuestion,
    reading: TrackReading,
    skip_bad: bool,
) -> PartsJob:
    """Return the job of a crowd in parts, in a folder named as the outputs without their endings.

    Raises InvalidField for outputs of several names, and as `crowd_formats.endings_of` does.
    """
    endings = crowd_formats.endings_of(outputs, question)
    pairs = zip(outputs, endings, strict=True)
    names = (path.with_name(path.name.removesuffix(f".{end}")) for path, end in pairs)
    folder, *more = dict.fromkeys(names)
    if more:
        raise InvalidField("output", f"{folder} and {more[0]}, expected one name for all parts")
    identity = open_model(model).identity
    return PartsJob(model, identity, tracks, folder, endings, people, question, reading, skip_bad)


def write_parts(job: PartsJob, workers: int | None, scheduler: str | None) -> dict[str, Any]:
    """Write the parts of a crowd by processes or on a Dask cluster; return their manifest.

    Raises as `process_pool.open_runner` and `track_parts.write` do.
    """
    resumes = "finished parts are kept, and the same command resumes"
    workers = workers if workers is not None or scheduler else 1
    opened = process_pool.open_runner(workers, scheduler, resumes)
    with opened as runner, ExitStack() as bars:
        return track_parts.write(
            job, runner, lambda count: bars.enter_context(ProgressBar("parts", count)).advance
        )


def parts_text(manifest: dict[str, Any], folder: Path) -> str:
    """Return the report of a crowd in parts as text."""
    records = manifest["parts"]
    size = sum(record["bytes"] for record in records)
    files = [record for record in records if record["file"]]
    worst = max(record["path_error_cm"]["worst"] for record in files)
    people = counted(sum(len(record["people"]) for record in files), "character")
    lines = [
        f"{folder}: {people} in {counted(len(files), 'file')}, {size / 1e6:.1f} MB",
        f"smoothed paths are {worst:.1f} cm away from their tracks at most",
    ]
    skipped = track_crowd.left_out(manifest["skipped"])
    pairs = (zip(record["excess"], record["warnings"], strict=True) for record in records)
    worst_first = [line for _, line in sorted(chain(*pairs), key=lambda pair: -pair[0])]
    return "\n".join(lines + track_crowd.shorten(skipped) + track_crowd.shorten(worst_first))


class RouteQuestion(Struct, frozen=True, forbid_unknown_fields=True):
    """Route of a JSON file: x and z of its places, m, and the speed, m/s."""

    waypoints: list[tuple[float, float]]
    speed: float


def routes(path: Path) -> Sequence[Route]:
    """Return the routes of a JSON file; FileError without one, and FormError for invalid ones."""
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    questions = json_decoding.decode_question(list[RouteQuestion], content)
    if not questions:
        raise InvalidField("paths", "no route, expected one or more")
    return [Route(np.array(route.waypoints), route.speed) for route in questions]


@dataclass(frozen=True)
class _FootSkateMeter:
    """Foot skate of motions as they are written; empty if the model's card names no feet."""

    gait: Gait
    rate: float
    samples: list[Floats] = field(default_factory=list)
    standing: list[StandingFeet] = field(default_factory=list)

    def measure(self, motions: Motions) -> None:
        card = self.gait.session.card
        if motions.feet:
            self.standing.append(motions.feet)
            self.samples.append(motions.feet.skate)
        elif card.feet:
            self.samples.append(walking_crowd.measure_foot_skate(card, motions, self.rate).ravel())

    def facts(self) -> dict[str, float]:
        if not self.samples:
            return {}
        facts = {
            "skate_cm_per_s": np.concatenate(self.samples).mean(),
            "skate_strides_cm_per_s": walking_crowd.mean_foot_skate(self.gait, self.rate),
        }
        if self.standing:
            before, drift, lowered = (
                np.concatenate([getattr(feet, name) for feet in self.standing])
                for name in ("skate_before", "drift", "lowered")
            )
            facts["skate_before_cm_per_s"] = before.mean()
            facts |= {"drift_cm": drift.max(), "lowered_cm": lowered.max()}
        return {name: round(100.0 * float(metres), 2) for name, metres in facts.items()}


def _with_progress(crowd: CrowdClip, motions: int, feet: _FootSkateMeter) -> CrowdClip:
    """Return the crowd with a progress bar on standard error while its motions are computed."""

    def batches() -> Iterator[Motions]:
        with ProgressBar("motions", motions) as bar:
            for batch in crowd.batches:
                feet.measure(batch)
                yield batch
                bar.advance(len(batch))

    return replace(crowd, batches=batches())


def report_text(facts: dict[str, Any]) -> str:
    """Return the report of a crowd as text."""
    lines = [
        f"{', '.join(facts['files'])}: {counted(facts['characters'], 'character')}, "
        f"{counted(facts['frames'], 'frame')} at {facts['rate']:g} a second, seed {facts['seed']}"
    ]
    if "level_shares" in facts:
        shares = (f"{100.0 * share:.3g} %" for share in facts["level_shares"])
        lines.append(f"poses at each level of detail, the finest first: {', '.join(shares)}")
    if "skate_cm_per_s" in facts:
        lines.append(
            f"feet on the ground slide at {facts['skate_cm_per_s']:.1f} cm/s, those of the model's "
            f"own strides at the captured controls at {facts['skate_strides_cm_per_s']:.1f} cm/s"
        )
    if "skate_before_cm_per_s" in facts:
        lines.append(
            f"feet stand: as predicted they would slide at {facts['skate_before_cm_per_s']:.1f} "
            f"cm/s; a standing foot moves {facts['drift_cm']:.1f} cm at most, and a pelvis is "
            f"lowered {facts['lowered_cm']:.1f} cm at most"
        )
    if facts["take"]:
        take = facts["take"]
        which = f"take {take['seed']}" if take["seed"] else "no take"
        which = "a take for each motion" if take["seed"] == "index" else which
        detail = ", with details sampled" if take["detail"] else ""
        lines.append(f"{which}, variety {take['variety']:g}{detail}")
    if facts.get("outside_share"):
        lines.append(
            f"{100 * facts['outside_share']:.1f} % of the poses have some control outside what was "
            "sampled"
        )
    if "path_error_cm" in facts:
        errors = facts["path_error_cm"]
        lines.append(
            f"smoothed paths are {errors['mean']:.1f} cm away from their tracks in the mean and "
            f"{errors['worst']:.1f} cm at most"
        )
    lines += track_crowd.shorten(track_crowd.left_out(facts.get("skipped", {})))
    return "\n".join([*lines, *track_crowd.shorten(facts["warnings"])])
