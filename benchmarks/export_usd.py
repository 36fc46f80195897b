"""Clips to the bytes of USD files, against the UsdSkel schema API and against plain layers.

    OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/export_usd.py [--record]

Every file has skeleton, animation, body, extent and facts. Where body and extent are given, all are
timed from the same arrays; where they are made, so is all that a file holds, 32 clips at a time.
"""

import itertools
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from msgspec import structs
from pxr import Gf, Kind, Usd, UsdGeom, UsdSkel, Vt
from rows import Row, record, table
from timing import in_turn

from posefield.encode import character, crate_template, extent, layers, usd_clip, usd_library
from posefield.encode.character import METRES, CharacterRig
from posefield.encode.crate_template import LayerBuilder, LayerContent
from posefield.motion import clip as clips
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.question.results import ClipAnswer, Trust

CLIPS, FRAMES, JOINTS, ENTRIES = 32, 100, 30, 100_000
RESULTS = Path(__file__).parents[1] / "docs/results/speed"
SIZE = f"{JOINTS} joints × {FRAMES} frames"
FOLDER = Path("/dev/shm") if Path("/dev/shm").is_dir() else None


def rows() -> list[Row]:
    """Milliseconds a clip as usdc and usdz, and the ratios to the rivals'."""
    answers = _answers(CLIPS)
    return [*_layers(answers), *_package(answers), *_others(answers)]


def _layers(answers: list[ClipAnswer]) -> list[Row]:
    one, builders = answers[0], list(usd_clip.builders_and_contents(answers, METRES))
    expected = [author.layer(content).ExportToString() for author, content in builders]
    for _ in range(2):
        if list(map(layers.crate_text, usd_clip.usdc(answers, METRES))) != expected:
            raise AssertionError("usdc differs from what usd-core writes")
    with TemporaryDirectory(dir=FOLDER) as folder:
        path, (author, content) = Path(folder, "clip.usdc"), builders[0]
        timings = in_turn(
            {
                "filled": lambda: [crate_template.usdc(*builder) for builder in builders],
                "ours": lambda: usd_clip.usdc(answers, METRES),
                "alone": lambda: usd_clip.usdc([one], METRES),
                "sdf": lambda: _crate(*_first([one])),
                "layer": lambda: _crate(author, content),
                "arrays": lambda: _schemas(one.clip, content, _arrays, path),
                "lists": lambda: _schemas(one.clip, content, _lists, path),
            },
            rounds=15,
            repeats=2,
        )
    filled, ours = timings["filled"] / CLIPS, timings["ours"] / CLIPS
    with_parts, without_parts = "usdc, body and extent given", "usdc, body and extent made"
    return [
        _row(with_parts, filled, f"UsdSkel schema API, {LISTS}", timings["lists"], 200.0),
        _row(with_parts, filled, f"UsdSkel schema API, {ARRAYS}", timings["arrays"], None),
        _row(with_parts, filled, "Sdf layer, the same", timings["layer"], 20.0),
        _row(
            without_parts,
            ours,
            f"UsdSkel schema API, {LISTS}, body and extent given",
            timings["lists"],
            None,
        ),
        _row(without_parts, ours, "Sdf layer, the same one clip at a time", timings["sdf"], None),
        _row(without_parts, ours, "ours, one clip at a time", timings["alone"], None),
    ]


LISTS, ARRAYS = "a Gf value a joint, frame by frame", "arrays from NumPy, frame by frame"


def _row(name: str, ours: float, words: str, theirs: float, goal: float | None) -> Row:
    against = f"{words}: {1e3 * theirs:.3g} ms"
    return Row(f"clip to {name}, {SIZE}", 1e3 * ours, "ms", against, theirs / ours, goal)


def _package(answers: list[ClipAnswer]) -> list[Row]:
    one = answers[0]
    timings = in_turn(
        {
            "usdz": lambda: usd_clip.usdz(answers, METRES),
            "sdf": lambda: usd_clip.usdz_package(_crate(*_first([one]))),
        },
        rounds=15,
        repeats=2,
    )
    words = "Sdf layer and the same zip, one clip at a time"
    ours = timings["usdz"] / CLIPS
    return [_row("usdz, body and extent made", ours, words, timings["sdf"], None)]


def _others(answers: list[ClipAnswer]) -> list[Row]:
    """Time an animation alone, a clip that warns, the first clips of a kind, a library."""
    timings = in_turn(
        {
            "whole": lambda: usd_clip.usdc(answers, METRES),
            "bare": lambda: usd_clip.animation_usdc(answers, METRES),
            "warned": lambda: usd_clip.usdc(_warned(answers), METRES),
            "new": lambda: _new(answers[:3]),
        },
        rounds=9,
        repeats=1,
    )
    milliseconds = {name: 1e3 * seconds / CLIPS for name, seconds in timings.items()}
    warned = milliseconds["warned"] / milliseconds["whole"]
    clip = answers[0].clip
    low, high = extent.pose_independent_box(
        clip.skeleton, clip.translations[0], clip.root_path
    ).tolist()
    entries = [
        usd_library.LibraryEntry(f"clip {i}", f"clips/{i}.usdc", len(clip), clip.rate, low, high)
        for i in range(100)
    ]
    some = list(itertools.islice(itertools.cycle(entries), ENTRIES))
    stage = in_turn({"stage": lambda: _stage(answers[0], some)}, rounds=1, repeats=1)["stage"]
    return [
        Row("animation alone as usdc", milliseconds["bare"], "ms", SIZE, None, None),
        Row(
            "clip as usdc, against",
            milliseconds["warned"],
            "ms",
            "with warnings of its own",
            warned,
            None,
        ),
        Row("template of a new kind", 1e3 * timings["new"], "ms", "and three clips", None, None),
        Row(f"library stage of {ENTRIES} clips", stage, "s", "", None, None),
    ]


def _warned(answers: list[ClipAnswer]) -> list[ClipAnswer]:
    """The same with a warning that no other clip has had."""
    return [
        replace(
            answer, trust=structs.replace(answer.trust, warnings=(f"control = {next(SERIAL)}",))
        )
        for answer in answers
    ]


SERIAL = itertools.count()


def _new(answers: list[ClipAnswer]) -> None:
    crate_template.template.cache_clear()
    usd_clip.usdc(answers, METRES)


def _stage(answer: ClipAnswer, entries: list[usd_library.LibraryEntry]) -> bytes:
    return usd_library.library_stage(answer.clip.skeleton, METRES, 30.0, entries)


def _crate(author: LayerBuilder, content: LayerContent) -> bytes:
    return layers.crate_bytes(author.layer(content))


def _first(answers: list[ClipAnswer]) -> tuple[usd_clip.ClipLayerBuilder, LayerContent]:
    return next(usd_clip.builders_and_contents(answers, METRES))


def _answers(count: int) -> list[ClipAnswer]:
    """Clips that differ in all that clips of one model can."""
    person, rng = _person(), np.random.default_rng(3)
    t = np.arange(FRAMES)[:, None, None] / 30
    answers = []
    for _ in range(count):
        pace, phase = rng.uniform(0.5, 1.5, (2, JOINTS, 3))
        path = rng.uniform(-1, 1, 3) * (1, 0.05, 1) * t[:, 0] + (0, 0.9, 0)
        offsets = rng.uniform(0.9, 1.1, (JOINTS, 1)) * person.offsets
        clip = clips.assemble(person, quat.exp(np.sin(pace * t + phase)), path, offsets, 30.0)
        controls = {f"control {index}": float(rng.uniform()) for index in range(6)}
        duration, sigma = (float(np.float32(number)) for number in rng.uniform(0, 2, 2))
        answers.append(
            ClipAnswer(clip, Trust("walk@0123abcd", controls, None, 0, duration, sigma, True, ()))
        )
    return answers


def _person() -> Skeleton:
    """A spine of six joints and four limbs of six, of which each has a tip."""
    limbs = [(hold, *range(at, at + 5)) for hold, at in ((0, 6), (0, 12), (4, 18), (4, 24))]
    parents = [-1, *range(5), *itertools.chain.from_iterable(limbs)]
    offsets = np.random.default_rng(2).uniform((-0.1, 0, -0.1), (0.1, 0.2, 0.1), (JOINTS, 3))
    labels = tuple(f"joint{index}" for index in range(JOINTS))
    return Skeleton(labels, tuple(parents), offsets, (11, 17, 23, 29), np.full((4, 3), 0.05))


Convert = Callable[[Clip, int], tuple[Any, Any]]


def _arrays(clip: Clip, frame: int) -> tuple[Any, Any]:
    turns = np.roll(clip.rotations[frame], -1, axis=-1)
    return Vt.Vec3fArray.FromNumpy(clip.translations[frame]), Vt.QuatfArray.FromNumpy(turns)


def _lists(clip: Clip, frame: int) -> tuple[Any, Any]:
    moves, turns = clip.translations[frame], clip.rotations[frame]
    return [Gf.Vec3f(*move) for move in moves], [Gf.Quatf(*turn) for turn in turns]


def _schemas(clip: Clip, content: LayerContent, convert: Convert, path: Path) -> bytes:
    """A clip as the schema API's own examples write it."""
    stage, rig = Usd.Stage.CreateInMemory(), character.rig(clip.skeleton)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(30)
    stage.SetFramesPerSecond(30)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(FRAMES - 1)
    stage.SetMetadata("customLayerData", {"posefield": content.facts["controls"]})
    root = UsdSkel.Root.Define(stage, "/Character")
    stage.SetDefaultPrim(root.GetPrim())
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    extent = Vt.Vec3fArray.FromNumpy(content.values["extent"])
    root.CreateExtentAttr(extent)
    skeleton = _skeleton(stage, rig, content)
    for prim in (root.GetPrim(), _mesh(stage, rig, content, extent)):
        UsdSkel.BindingAPI.Apply(prim).CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    moving = UsdSkel.Animation.Define(stage, "/Character/Anim")
    moving.CreateJointsAttr(rig.paths)
    moves, turns = moving.CreateTranslationsAttr(), moving.CreateRotationsAttr()
    moving.CreateScalesAttr(Vt.Vec3hArray(JOINTS, Gf.Vec3h(1, 1, 1)))
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([moving.GetPath()])
    for frame in range(FRAMES):
        for attribute, value in zip((moves, turns), convert(clip, frame), strict=True):
            attribute.Set(value, frame)
    stage.GetRootLayer().Export(str(path))
    return path.read_bytes()


def _skeleton(stage: Any, rig: CharacterRig, content: LayerContent) -> Any:
    skeleton = UsdSkel.Skeleton.Define(stage, "/Character/Skel")
    skeleton.CreateJointsAttr(rig.paths)
    skeleton.CreateJointNamesAttr(character.legal_names(rig.names))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray.FromNumpy(content.values["bind"]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray.FromNumpy(content.values["rest"]))
    return skeleton


def _mesh(stage: Any, rig: CharacterRig, content: LayerContent, extent: Any) -> Any:
    mesh = UsdGeom.Mesh.Define(stage, "/Character/Body")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(content.values["points"]))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(rig.body.normals))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    counts, corners = (Vt.IntArray.FromNumpy(a) for a in (rig.body.counts, rig.body.corners))
    mesh.CreateFaceVertexCountsAttr(counts)
    mesh.CreateFaceVertexIndicesAttr(corners)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr(extent)
    mesh.CreateDisplayColorAttr([Gf.Vec3f(0.75)])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    joints, weights = rig.body.joints.reshape(-1), rig.body.weights.reshape(-1) / np.float32(255)
    influences = rig.body.joints.shape[1]
    binding.CreateJointIndicesPrimvar(False, influences).Set(Vt.IntArray.FromNumpy(joints))
    binding.CreateJointWeightsPrimvar(False, influences).Set(Vt.FloatArray.FromNumpy(weights))
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    return mesh.GetPrim()


if __name__ == "__main__":
    found = rows()
    print(table(found))
    if "--record" in sys.argv:
        record({"layers": found}, "python benchmarks/export_usd.py --record", RESULTS)
