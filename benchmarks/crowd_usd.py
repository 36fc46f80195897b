"""Crowds to USD on disk, against the UsdSkel schema API, which writes each character in full.

OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/crowd_usd.py
"""

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt
from rows import Row, table
from timing import in_turn

from posefield.common.units import Indices
from posefield.encode import character, crowd_writer
from posefield.motion import quat
from posefield.motion.clip import CrowdClip, Motions, Placement
from posefield.motion.skeleton import Skeleton

CHARACTERS, FRAMES, JOINTS, SHARED, BATCH = 500, 100, 31, 20, 50
LISTED, COPIED = 10, 50
"""Numbers of characters to time the schema API with; its time grows with their number."""
SIZE = f"{CHARACTERS} characters × {FRAMES} frames × {JOINTS} joints"


def rows() -> list[Row]:
    """Seconds to disk of unique and of shared motion, and the ratios to the schema API's."""
    person = _person()
    unique, shared = _motions(person, CHARACTERS), _motions(person, SHARED)
    build = Path(__file__).parents[1] / "build"
    build.mkdir(exist_ok=True)
    # Not in /tmp, where a file may take ten times as long to make where many come and go.
    with TemporaryDirectory(dir=build) as name:
        folder = Path(name)
        runs = {
            **{e: _ours(person, unique, folder / f"unique.{e}") for e in ("usd", "usdz", "usdc")},
            "shared": _ours(person, shared, folder / "shared.usd"),
            "lists": _schemas(person, unique, LISTED, _lists, folder / "lists.usdc"),
            "arrays": _schemas(person, unique, COPIED, _arrays, folder / "arrays.usdc"),
        }
        timings = in_turn(runs, rounds=5, repeats=1)
    lists, arrays = CHARACTERS / LISTED * timings["lists"], CHARACTERS / COPIED * timings["arrays"]
    return [
        _row(".usd and a layer for each motion", timings["usd"], 0.5),
        _row(".usdz of the same layers", timings["usdz"], 0.5),
        _row("one .usdc", timings["usdc"], None),
        _row(f".usd, {SHARED} motions shared", timings["shared"], 0.1),
        _against(f"a Gf value a joint; {LISTED} characters timed", lists, timings["usd"]),
        _against(f"arrays from NumPy; {COPIED} characters timed", arrays, timings["usd"]),
    ]


def _row(name: str, seconds: float, goal: float | None) -> Row:
    return Row(f"crowd to disk: {name}", seconds, "s", SIZE, None, goal)


def _against(words: str, theirs: float, ours: float) -> Row:
    baseline = f"UsdSkel schema API, all in one .usdc, {words}, without bodies: {theirs:.2g} s"
    return Row("crowd to disk: .usd, against", ours, "s", baseline, theirs / ours, None)


def _ours(person: Skeleton, motions: Motions, path: Path) -> Callable[[], None]:
    played = np.arange(CHARACTERS) % len(motions)
    return lambda: crowd_writer.write(_crowd(person, motions, played), path)


def _crowd(person: Skeleton, motions: Motions, played: Indices) -> CrowdClip:
    rng = np.random.default_rng(1)
    positions = rng.uniform(-50, 50, (len(played), 3)) * (1, 0, 1)
    placement = Placement(positions, rng.uniform(-np.pi, np.pi, len(played)))
    return CrowdClip(person, 30.0, FRAMES, placement, played, _batches(motions), {"seed": 1})


def _batches(motions: Motions) -> Iterator[Motions]:
    for start in range(0, len(motions), BATCH):
        chunk = slice(start, start + BATCH)
        arrays = (None if value is None else value[chunk] for value in vars(motions).values())
        yield Motions(*arrays)


def _person() -> Skeleton:
    """A spine of seven joints and four limbs of six."""
    limbs = ((hold, *range(at, at + 5)) for hold, at in ((0, 7), (0, 13), (5, 19), (5, 25)))
    parents = [-1, *range(6), *itertools.chain.from_iterable(limbs)]
    offsets = np.random.default_rng(2).uniform((-0.1, 0, -0.1), (0.1, 0.2, 0.1), (JOINTS, 3))
    labels = tuple(f"joint{index}" for index in range(JOINTS))
    return Skeleton(labels, tuple(parents), offsets, (), np.zeros((0, 3)))


def _motions(person: Skeleton, count: int) -> Motions:
    rng = np.random.default_rng(3)
    t = np.arange(FRAMES) / 30
    pace, phase = rng.uniform(0.5, 1.5, (2, count, 1, JOINTS, 3))
    turns = np.empty((count, FRAMES, JOINTS, 4), np.float32)
    for index in range(count):
        turns[index] = quat.exp(np.sin(pace[index] * t[:, None, None] + phase[index]))
    path = rng.uniform(-1, 1, (count, 1, 3)) * (1, 0.05, 1) * t[:, None] + (0, 0.9, 0)
    offsets = rng.uniform(0.9, 1.1, (count, JOINTS, 1)) * person.offsets
    levels = np.zeros((count, FRAMES), int)
    return Motions(turns, path.astype("f4"), offsets.astype("f4"), levels)


Convert = Callable[[Motions, int, int], tuple[Any, Any]]


def _lists(motions: Motions, index: int, frame: int) -> tuple[Any, Any]:
    offsets = [motions.root_position[index, frame], *motions.bone_offsets[index, 1:]]
    turns = motions.rotations[index, frame].tolist()
    return (
        Vt.Vec3fArray([Gf.Vec3f(*offset.tolist()) for offset in offsets]),
        Vt.QuatfArray([Gf.Quatf(w, x, y, z) for w, x, y, z in turns]),
    )


def _arrays(motions: Motions, index: int, frame: int) -> tuple[Any, Any]:
    offsets = motions.bone_offsets[index].copy()
    offsets[0] = motions.root_position[index, frame]
    turns = np.roll(motions.rotations[index, frame], -1, axis=-1)
    return Vt.Vec3fArray.FromNumpy(offsets), Vt.QuatfArray.FromNumpy(turns)


def _schemas(
    person: Skeleton, motions: Motions, count: int, convert: Convert, path: Path
) -> Callable[[], None]:
    """Return a function that writes `count` characters as the schema API's examples do."""

    def run() -> None:
        path.unlink(missing_ok=True)
        stage = Usd.Stage.CreateNew(str(path))
        for index in range(count):
            _character(stage, f"/Crowd/c{index:05}", person, motions, index, convert)
        stage.Save()

    return run


def _character(
    stage: Any, at: str, person: Skeleton, motions: Motions, index: int, convert: Convert
) -> None:
    joints = character.joint_paths(character.legal_names(person.names), person.parents)
    root = UsdSkel.Root.Define(stage, at)
    skeleton = UsdSkel.Skeleton.Define(stage, f"{at}/Skel")
    animation = UsdSkel.Animation.Define(stage, f"{at}/Anim")
    UsdGeom.Xformable(root).AddTransformOp().Set(Gf.Matrix4d(1.0))
    for joined in (skeleton, animation):
        joined.CreateJointsAttr(joints)
    at_rest = Vt.Matrix4dArray(len(joints), Gf.Matrix4d(1.0))
    skeleton.CreateRestTransformsAttr(at_rest)
    skeleton.CreateBindTransformsAttr(at_rest)
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPrim().GetPath()])
    moves, turns = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    animation.CreateScalesAttr(Vt.Vec3hArray(len(joints), Gf.Vec3h(1, 1, 1)))
    for frame in range(FRAMES):
        for attribute, value in zip((moves, turns), convert(motions, index, frame), strict=True):
            attribute.Set(value, frame)


if __name__ == "__main__":
    print(table(rows()))
