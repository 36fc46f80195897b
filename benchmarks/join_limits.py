"""Share of captured motion, of blended joins and of plain cuts that a limit on the peak flags.

Motion without a join, in parts of 0.7 s, and joins of takes of one performer should pass; plain
cuts between the same takes should not. The limit is a multiple of the 99th percentile on the card.
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rows import Row, table
from scipy.interpolate import CubicSpline

from posefield.feet import footsteps
from posefield.feet.footsteps import Character
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.performance import join_quality, joins
from posefield.performance.joins import Blend
from posefield.performance.passage import RATE, Passage
from posefield_train.graph import trained_card
from posefield_train.source import data_folder, ingest, recipe
from posefield_train.source.ingest import Example

FACTORS = (1.5, 2.0, 2.5, 3.0, 4.0)
WINDOW = 43
"""Frames near a join in which its peak is looked for."""
REACH = 15
"""Frames in which a join leaves a take, and enters the next one."""


@dataclass
class Peaks:
    """Peaks over the usual acceleration: of captured motion, blended joins and plain cuts."""

    captured: list[float] = field(default_factory=list)
    blended: list[float] = field(default_factory=list)
    cut: list[float] = field(default_factory=list)


def passage_of(clip: Clip) -> Passage:
    """Return a clip as a passage at `RATE`."""
    step = clip.rate / RATE
    times = step * np.arange(int((len(clip) - 1) / step + 1e-6) + 1)
    frames = np.arange(len(clip))
    turns = CubicSpline(frames, quat.unroll(clip.rotations), axis=0)(times)
    roots = CubicSpline(frames, clip.root_path, axis=0)(times)
    none = np.zeros((len(times), 0))
    return Passage(quat.normalize(turns), roots, none, np.zeros(len(times)))


def pairs(examples: Sequence[Example]) -> Iterator[tuple[Clip, Clip]]:
    """Yield each clip with the next one of its performer."""
    groups = defaultdict(list)
    for example in examples:
        groups[example.row.performer].append(example.captured or example.clip)
    for clips in groups.values():
        if len(clips) > 1:
            yield from zip(clips, [*clips[1:], clips[0]], strict=True)


def peak(body: Character, passage: Passage, frame: int) -> float:
    """Return the largest acceleration near a frame, m/s²."""
    accelerations = join_quality.accelerations(body, passage, frame - 6, frame + WINDOW - 6)
    return float(accelerations.max(initial=0.0))


def join_peaks(before: Clip, after: Clip, cyclic: bool) -> tuple[float, float]:
    """Return the peaks of the blended join and of the plain cut of two clips, m/s².

    A cycle goes on at its end, another motion in its middle.
    """
    bones = before.translations[0].copy()
    bones[0] = 0.0
    body = footsteps.choose_limbs(before.skeleton.parents, bones, (), ())[0]
    first, second = passage_of(before), passage_of(after)
    leave = len(first) - 1 if cyclic else len(first) // 2 + REACH // 2
    enter = REACH // 2 if cyclic else len(second) // 2
    exits = range(max(leave - REACH + 1, 1), min(leave + 1, len(first)))
    entries = range(max(enter - REACH // 2, 0), min(enter + REACH // 2 + 1, len(second) - 1))
    cut = joins.find_cut(body, first, second, exits, entries)
    second = second.placed(cut.motion)
    kinds: tuple[Blend, Blend] = ("hermite" if cyclic else "dead", "cut")
    blended, plain = (peak(body, joins.join(first, second, cut, kind), cut.exit) for kind in kinds)
    return blended, plain


def family_peaks(path: Path, data: Path) -> tuple[float, Peaks]:
    """Return the 99th percentile of a recipe's clips, m/s², and the peaks over it."""
    family_recipe = recipe.read(path)
    examples, _ = ingest.ingest(family_recipe, data)
    captured = trained_card.captured_acceleration(examples)
    if captured is None:
        raise ValueError(f"{path.stem} has no clip of three frames, expected longer ones")
    peaks = Peaks()
    for example in examples:
        accelerations = trained_card.clip_accelerations(example.captured or example.clip)
        starts = range(0, max(len(accelerations) - WINDOW + 1, 1), WINDOW // 2)
        peaks.captured += [
            float(accelerations[at : at + WINDOW].max()) / captured.p99 for at in starts
        ]
    for before, after in pairs(examples):
        blended, plain = join_peaks(before, after, family_recipe.motion.cyclic)
        peaks.blended.append(blended / captured.p99)
        peaks.cut.append(plain / captured.p99)
    return captured.p99, peaks


def rows(data: Path) -> Iterator[Row]:
    """Yield the shares that each limit flags, by family."""
    for path in sorted(Path(data_folder.__file__).parents[1].glob("recipes/*.toml")):
        p99, peaks = family_peaks(path, data)
        sizes = f"{len(peaks.captured)} parts, {len(peaks.blended)} joins, p99 {p99:.3g} m/s²"
        for factor in FACTORS:
            captured, blended, plain = (
                100.0 * float(np.mean(np.array(values) > factor))
                for values in (peaks.captured, peaks.blended, peaks.cut)
            )
            note = f"captured; {blended:.1f} % of joins, {plain:.1f} % of cuts; {sizes}"
            yield Row(f"{path.stem}: above {factor:g} times", captured, "%", note, None, None)


def main(arguments: Sequence[str]) -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder of the captured data")
    print(table(list(rows(parser.parse_args(arguments).data))))


if __name__ == "__main__":
    main(sys.argv[1:])
