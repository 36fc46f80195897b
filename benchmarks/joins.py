"""Joins of captured takes, with and without placed feet, against the take's own continuation.

A reach is joined to the motion after the target of another take by the same performer, a stride to
a stride of another take. The take's own continuation shows how fast captured joints accelerate
there.
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rows import Row, record, table

from posefield.common import frame_groups
from posefield.feet import body_plans, foot_placement, footsteps, stance_rows
from posefield.feet.footsteps import Character, PlanRequest
from posefield.motion import contact_detection
from posefield.motion.clip import Clip
from posefield.motion.contact_detection import FootContact
from posefield.performance import join_quality, joins
from posefield.performance.join_quality import JoinFacts
from posefield.performance.joins import Blend, Cut
from posefield.performance.passage import RATE, Passage
from posefield_train.graph import trained_card
from posefield_train.source import canonical, clip_table, data_folder, ingest, recipe

ROOT = Path(__file__).resolve().parents[1]
AFTER, LEAST = 1.2, 0.6
"""Seconds of a take beyond its event that are joined, and the least that must be there."""
SQUAT, STOOP = 0.65, 0.75
"""Heights of the root at the event below, and above, which a deposit is one of the two, m."""
FAMILIES: tuple[tuple[str, bool, Blend, float | None], ...] = (
    ("hdm05_grab_high", False, "dead", 2.5),
    ("hdm05_deposit_floor", False, "dead", None),
    ("cmu_walk", True, "hermite", 1.2),
)
"""Recipes, whether they repeat, their blends, and the goals for peaks over real ones."""


@dataclass(frozen=True)
class Take:
    """A captured take at `RATE`.

    passage: all of its frames. event: frame at which it is joined. begin: first frame that may be
    entered, of a stride.
    """

    name: str
    performer: str
    character: Character
    contacts: tuple[FootContact, ...]
    passage: Passage
    event: int
    begin: int


@dataclass(frozen=True)
class Join:
    """Measures of a join of two takes.

    facts: of the join with placed feet. real, blended: peak accelerations of the take's own
    continuation, and of the join before feet are placed, m/s². slides: distances by which standing
    feet slide near the join, m. lowered: mean lowering of the pelvis there, m. height: of the root
    at the events of the two takes, m.
    """

    facts: JoinFacts
    real: float
    blended: float
    slides: tuple[float, ...]
    lowered: float
    height: tuple[float, float]


def takes(name: str, data: Path) -> list[Take]:
    """Return the takes of a recipe whose files go on beyond the clips."""
    path = next(Path(data_folder.__file__).parents[1].glob(f"recipes/{name}.toml"))
    family_recipe = recipe.read(path)
    rows = clip_table.read(family_recipe, data)
    files = ingest.read_files(rows, family_recipe.source)
    recordings = []
    for row in rows:
        clip = ingest.clip_of_file(files[str(row.file)], family_recipe.source)
        if row.last_frame is not None and row.last_frame + round(LEAST * clip.rate) < len(clip):
            recordings.append(_take(row, clip, family_recipe.motion.feet))
    return recordings


def captured(name: str, data: Path) -> float:
    """Return the accelerations of a recipe's clips, as the card of its model has them."""
    path = next(Path(data_folder.__file__).parents[1].glob(f"recipes/{name}.toml"))
    examples, _ = ingest.ingest(recipe.read(path), data)
    acceleration = trained_card.captured_acceleration(examples)
    if acceleration is None:
        raise ValueError(f"{name} has no clip of three frames, expected longer ones")
    return acceleration.p99


def _take(row: clip_table.ClipRow, clip: Clip, feet: Sequence[str]) -> Take:
    """Return the take of a row, mended as training does: hips that turn half about their bone."""
    clip, _ = canonical.remove_jumps(clip, 0)
    joints = [clip.skeleton.names.index(name) for name in feet]
    step = round(clip.rate / RATE)
    paths = clip.positions()[:, joints]
    contacts = np.stack(
        [
            contact_detection.detect_contacts(path, clip.rate, False)
            for path in paths.swapaxes(0, 1)
        ],
        axis=1,
    )[::step]
    bones = clip.translations[0].copy()
    bones[0] = 0.0
    chosen = footsteps.choose_limbs(clip.skeleton.parents, bones, joints, ())[0]
    intervals = []
    for foot, joint in enumerate(joints):
        row = frame_groups.one_row(len(contacts), RATE)
        likely = np.round(contacts[:, foot].astype(float), stance_rows.DECIMALS)
        down = stance_rows.tidy(likely > stance_rows.STANDING, row).mask(row)
        intervals.append(stance_rows.statistics(joint, paths[::step, foot, 1], RATE, down))
    passage = Passage(
        clip.rotations[::step],
        clip.root_path[::step],
        contacts.astype(float),
        np.zeros(len(contacts)),
    )
    first, last = row.first_frame // step, (row.last_frame or 0) // step
    return Take(row.named, row.performer, chosen, tuple(intervals), passage, last, first)


def pairs(recordings: Sequence[Take], all_pairs: bool = False) -> Iterator[tuple[Take, Take]]:
    """Yield each take with the next one of its performer, or with every other."""
    groups = defaultdict(list)
    for take in recordings:
        groups[take.performer].append(take)
    for group in groups.values():
        for index, take in enumerate(group):
            rest = [group[(index + offset) % len(group)] for offset in range(1, len(group))]
            yield from ((take, other) for other in (rest if all_pairs else rest[:1]))


def join(take: Take, other: Take, cyclic: bool, kind: Blend, typical: float) -> Join:
    """Return the measures of a join of two takes. usual: what it is compared with."""
    body, rest = take.character, len(other.passage)
    before = take.passage.part(0, take.event + 1)
    if cyclic:
        after = other.passage.part(other.begin, rest)
        exits, entries = 12, other.event - other.begin
    else:
        after = other.passage.part(other.event, min(other.event + round(AFTER * RATE), rest))
        exits, entries = 15, 21
    before, _ = join_quality.on_floor(body, before, take.contacts)
    after, _ = join_quality.on_floor(body, after, take.contacts)
    window = range(len(before) - exits, len(before))
    cut = joins.find_cut(body, before, after, window, range(entries))
    after = after.placed(cut.motion)
    joined = joins.join(before, after, cut, kind)
    stepped, _ = join_quality.add_steps(body, before, after, cut, joined)
    placed, slides, lowered = _placed(take, stepped, cut)
    drop = abs(float(before.roots[cut.exit, 1] - after.roots[cut.entry, 1]))
    real, blended, peak = (
        _peak(body, passage, cut.exit) for passage in (take.passage, joined, placed)
    )
    high, low = (float(side.passage.roots[side.event, 1]) for side in (take, other))
    facts = JoinFacts(cut.distance, drop, kind, typical, "captured", peak=peak)
    return Join(facts, real, blended, slides, lowered, (high, low))


def _placed(take: Take, passage: Passage, cut: Cut) -> tuple[Passage, tuple[float, ...], float]:
    """Return a passage with placed feet, how far feet that stand at the join slide, and the mean
    lowering of the pelvis near it, m."""
    motion = passage.rotations, passage.roots, RATE
    request = PlanRequest(take.character, *motion, take.contacts, passage.contacts)
    (plan,) = body_plans.plan_motions([request])
    times = np.arange(len(passage)) / RATE
    rotations, roots = foot_placement.place_feet(plan, times, passage.rotations, passage.roots)
    placed = Passage(rotations, roots, passage.contacts, passage.sigmas)
    near = _near(cut.exit, len(passage))
    points = joins.positions(take.character, placed, 0, len(placed))[..., [0, 2]]
    slides = []
    for leg, steps in zip(take.character.legs, plan.steps, strict=True):
        for stance in steps.stances:
            if stance.start < near.stop and stance.stop > near.start:
                path = points[stance.start : stance.stop, leg.tip]
                slides.append(float(np.linalg.norm(path - path[0], axis=-1).max()))
    return placed, tuple(slides), float((plan.lowered - plan.grounded)[near].mean())


def _near(frame: int, count: int) -> slice:
    first, last = frame - round(0.1 * RATE), frame + round(0.6 * RATE) + 1
    return slice(max(first, 0), min(last, count))


def _peak(body: Character, passage: Passage, frame: int) -> float:
    near = _near(frame, len(passage))
    accelerations = join_quality.accelerations(body, passage, near.start, near.stop)
    return float(accelerations.max())


def rows(data: Path) -> list[Row]:
    """Return the figures of joins of reaches and of strides."""
    table_rows = []
    for name, cyclic, kind, goal in FAMILIES:
        typical = captured(name, data)
        joins = [join(*pair, cyclic, kind, typical) for pair in pairs(takes(name, data))]
        table_rows += _rows(f"{name}, {len(joins)} joins", joins, goal)
    deposits = takes("hdm05_deposit_floor", data)
    typical = captured("hdm05_deposit_floor", data)
    joins = [join(*pair, False, "dead", typical) for pair in pairs(deposits, True)]
    other = [
        join_found
        for join_found in joins
        if min(join_found.height) < SQUAT and max(join_found.height) > STOOP
    ]
    share = 100.0 * float(np.mean([bool(join_found.facts.reasons) for join_found in other]))
    same = [join_found for join_found in joins if join_found not in other]
    alike = 100.0 * float(np.mean([bool(join_found.facts.reasons) for join_found in same]))
    note = f"of {len(other)} joins of a squat and a stoop; {alike:.0f} % of {len(same)} others"
    missed_row = Row("hdm05_deposit_floor: joins not flagged", 100.0 - share, "%", note, None, 0.0)
    return [*table_rows, missed_row]


def _rows(title: str, joins: Sequence[Join], goal: float | None) -> list[Row]:
    real = float(np.median([join.real for join in joins]))
    plain, placed = (
        float(np.median(peaks))
        for peaks in ([join.blended for join in joins], [join.facts.peak for join in joins])
    )
    distance = 100.0 * float(np.median([join.facts.distance for join in joins]))
    slides = [round(100.0 * one, 3) for join in joins for one in join.slides]
    slide, worst = float(np.percentile(slides, 90)), max(slides)
    lowered = 100.0 * float(np.mean([join.lowered for join in joins]))
    hard = 100.0 * float(np.mean([bool(join.facts.reasons) for join in joins]))
    against = f"median peak {plain:.3g} m/s², real continuation {real:.3g}"
    return [
        Row(f"{title}: peak over the real one", plain / real, "times", against, None, goal),
        Row(f"{title}: with feet", placed / real, "times", f"{placed:.3g} m/s²", None, goal),
        Row(f"{title}: distance at the cut", distance, "cm", "median", None, None),
        Row(
            f"{title}: slide of standing feet",
            slide,
            "cm",
            f"90th percentile; worst {worst:.2g}",
            None,
            1.0,
        ),
        Row(f"{title}: pelvis lowered", lowered, "cm", "mean", None, 1.5),
        Row(f"{title}: flagged as hard", hard, "%", "", None, None),
    ]


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder of the captured data")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    table_rows = rows(options.data)
    print(table(table_rows))
    if options.record:
        command = "python benchmarks/joins.py DATA --record"
        record({"joins": table_rows}, command, ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
