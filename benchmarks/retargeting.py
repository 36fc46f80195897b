"""Retargeting of captured walks and of clips of the shipped walk onto other proportions.

Rigs are GLB files with the skeletons of captured performers. Foot skate counts while the motion's
feet stand, and is compared with that of the motion in proportion to the legs.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rows import Row, table

from posefield.console.options import open_model
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import SampledClip, Trust
from posefield.registry import model_registry
from posefield.retarget.retargeting import RetargetReport, retarget
from posefield.rigs.rig import Rig, read_rig
from posefield.synthesis import clips
from posefield_train.source import clip_table, data_folder, ingest, recipe
from posefield_train.source.recipe import Recipe

BODIES = {
    "HDM05 bk": ("hdm05_grab_high", "HDM_bk_"),
    "HDM05 mm": ("hdm05_grab_high", "HDM_mm_"),
    "Bandai": ("bandai_raise_hand", ""),
}
"""Families and beginnings of the files whose first one gives a rig."""
SPEEDS = (0.8, 1.0, 1.2, 1.4, 1.6)
"""Speeds of the clips of the shipped walk, m/s."""
TRUST = Trust("a@0123456789abcdef", {}, None, 0, 1.0, 0.0, True, ())
RATE = 60
SKATE, DEPTH, TURNED = 1.1, 1.0, 5.0
"""Goals: skate over the motion's, depth below the floor in cm, turn of legs in degrees."""


@dataclass(frozen=True)
class Motion:
    """A motion with the joints of its roles."""

    clip: Clip
    roles: dict[str, str]


def recipe_of(name: str, data: Path) -> Recipe:
    """Return a shipped recipe."""
    return recipe.read(data_folder.recipe_file(Path(name), data))


def first_clip(name: str, beginning: str, data: Path) -> Clip:
    """Return the whole motion of the first file of a family with a beginning of its name."""
    family_recipe = recipe_of(name, data)
    rows = [
        row for row in clip_table.read(family_recipe, data) if row.file.name.startswith(beginning)
    ]
    examples = ingest.read_files(rows[:1], family_recipe.source)
    (file,) = examples.values()
    clip = ingest.clip_of_file(file, family_recipe.source)
    return standing(clip) if name.startswith("bandai") else clip


def standing(clip: Clip) -> Clip:
    """Return a clip of one frame whose skeleton is at rest as in the clip's first frame.

    Joints of Bandai-Namco's files are at rest along one axis, which no character's file is.
    """
    positions, joints = clip.positions()[0], clip.skeleton
    offsets = positions - positions[list(joints.parents)]
    offsets[0] = positions[0]
    rest = replace(joints, offsets=offsets, tip_joints=(), tip_offsets=np.zeros((0, 3)))
    still = np.tile(quat.IDENTITY, (1, len(joints), 1))
    return Clip(rest, still, offsets[None], clip.rate)


def rig_of(clip: Clip, folder: Path, name: str) -> Rig:
    """Return the rig of a GLB file with the skeleton of a clip."""
    path = folder / f"{name.replace(' ', '_')}.glb"
    path.write_bytes(CLIP_ENCODERS["glb"].encode(SampledClip(clip, TRUST)))
    return read_rig(path)


def captured_walks(data: Path) -> list[Motion]:
    """Return the whole captured walks at 60 frames a second, without their first frame, a T pose.

    Their joints have roles by their names.
    """
    family_recipe = recipe_of("cmu_walk", data)
    files = ingest.read_files(clip_table.read(family_recipe, data), family_recipe.source)
    walks = []
    for file in files.values():
        clip = ingest.clip_of_file(file, family_recipe.source)
        frames = slice(1, None, round(clip.rate / RATE))
        turns, positions = clip.rotations[frames], clip.translations[frames]
        walks.append(Motion(replace(clip, rotations=turns, translations=positions, rate=RATE), {}))
    return walks


def shipped_walks() -> list[Motion]:
    """Return clips of the shipped walk, whose feet stand."""
    model = open_model(model_registry.SHIPPED_FOLDER / "cmu_walk.onnx")
    roles = model.session.card.roles
    return [
        Motion(
            clips.synthesize_clip(model, ClipQuestion(controls={"speed": v}, fps=RATE)).clip, roles
        )
        for v in SPEEDS
    ]


def figures(name: str, reports: Sequence[RetargetReport]) -> Iterator[Row]:
    """Yield the rows of one kind of motions on one rig."""

    def mean(values: Sequence[float]) -> float:
        return float(np.mean(values))

    before = mean([report.skate_source for report in reports])
    copied, after = (mean([getattr(r, f) for r in reports]) for f in ("skate_copied", "skate"))
    note = f"{len(reports)} motions, legs {mean([r.scale for r in reports]):.2f} times as long"
    speeds = f"{1e3 * before:.2f} mm/s of the motion; {1e3 * copied:.2f} copied"
    if before > 1e-3:
        yield Row(f"{name}: skate over the motion's", after / before, "", speeds, None, SKATE)
    else:
        yield Row(f"{name}: skate", 1e3 * after, "mm/s", speeds, None, 1.0)
    depth = 100.0 * max(r.penetration for r in reports)
    yield Row(f"{name}: depth below the floor, worst p99", depth, "cm", note, None, DEPTH)
    turned = np.degrees([r.legs_turned for r in reports])
    largest = (
        f"worst {turned.max():.1f}; pelvis lowered {100 * max(r.lowered for r in reports):.1f} cm"
    )
    yield Row(f"{name}: legs turned, mean", mean(turned.tolist()), "degrees", largest, None, TURNED)


def spent(motion: Motion, rig: Rig) -> Row:
    """Return the processor time of 100 frames, against that of the clip's synthesis."""
    model = open_model(model_registry.SHIPPED_FOLDER / "cmu_walk.onnx")
    times = []
    for run in (
        lambda: clips.synthesize_clip(model, ClipQuestion(controls={}, fps=RATE)),
        lambda: retarget(motion.clip, rig, motion.roles),
    ):
        run()
        start = time.process_time()
        for _ in range(20):
            run()
        times.append((time.process_time() - start) / 20)
    share = 100.0 / len(motion.clip)
    return Row(
        "processor time of 100 frames",
        1e3 * share * times[1],
        "ms",
        f"synthesis {1e3 * share * times[0]:.1f} ms with standing feet",
        None,
        None,
    )


def main(arguments: Sequence[str]) -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder with the families, unpacked")
    options = parser.parse_args(arguments)
    shipped, captured = shipped_walks(), captured_walks(options.data)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        bodies = {
            name: first_clip(family, beginning, options.data)
            for name, (family, beginning) in BODIES.items()
        }
        bodies["shipped mannequin"] = shipped[0].clip
        for name, body in bodies.items():
            rig = rig_of(body, Path(folder), name)
            for kind, motions in (("shipped walk", shipped), ("CMU walks", captured)):
                reports = [retarget(motion.clip, rig, motion.roles)[1] for motion in motions]
                rows += figures(f"{kind} onto {name}", reports)
        rows.append(spent(shipped[2], rig))
    print(table(rows))


if __name__ == "__main__":
    main(sys.argv[1:])
