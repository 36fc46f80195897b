"""Tests of crowds of performances: places, levels of detail, bytes, and scripts that do not fit.

The oracle of the places is usd-core: it composes and poses what was written.
"""

import json

import exporting
import numpy as np
import pytest
from msgspec import structs
from pxr import Usd, UsdGeom, UsdSkel, UsdValidation

from posefield.batch import performance_crowd
from posefield.batch.performance_crowd import PerformanceCrowd
from posefield.batch.scripts import open_models, read_scripts
from posefield.common.errors import InvalidField
from posefield.inference.level_selection import Camera, LevelCriteria, pixels_per_metre
from posefield.performance import composition
from posefield.performance.script import resolve_script

WALK = {"kind": "walk", "model": "walk", "seconds": 1.0}
SCRIPTS = [
    {"name": "first", "segments": [WALK]},
    {
        "name": "far",
        "start": {"position": [3.0, 40.0], "heading": 2.5},
        "segments": [{**WALK, "turn": 0.3}, WALK],
    },
    {"name": "aside", "start": {"position": [-4.0, 1.0], "heading": -1.0}, "segments": [WALK]},
]
FILES = ("usd", "usda", "usdc", "usdz")
# Positions of float32 at 40 m, through a chain of joints.
NEAR = 1e-4


@pytest.fixture
def rows(tmp_path):
    return written(tmp_path, SCRIPTS)


def written(folder, scripts):
    path = folder / "scripts.jsonl"
    path.write_text("".join(json.dumps(script) + "\n" for script in scripts))
    return read_scripts(path)


def performed(models, script):
    return composition.perform(resolve_script(script, open_models((models,)).find), 1000)


def has_body(stage):
    body = stage.GetPrimAtPath("/Crowd/Characters/c00000").GetChild("Body")
    return bool(body) and body.IsA(UsdGeom.Mesh)


def world_joints(stage, index, frame):
    """Joint positions of a character in the world, by usd-core."""
    prim = stage.GetPrimAtPath(f"/Crowd/Characters/c{index:05}")
    cache, root = UsdSkel.Cache(), UsdSkel.Root(prim)
    assert cache.Populate(root, Usd.TraverseInstanceProxies())
    query = cache.GetSkelQuery(UsdSkel.Skeleton(prim.GetChild("Skel")))
    local = np.array(query.ComputeJointSkelTransforms(frame))
    placed = np.array(UsdGeom.XformCache(frame).GetLocalToWorldTransform(prim))
    return (local @ placed)[:, 3, :3]


@pytest.mark.parametrize("ending", FILES)
def test_each_character_plays_its_performance_at_its_place(ending, models, rows, tmp_path):
    crowd = PerformanceCrowd((models,), tmp_path / f"crowd.{ending}")
    facts = performance_crowd.write(crowd, rows)
    stage = Usd.Stage.Open(str(crowd.path))
    clips = [performed(models, row.question).clip for row in rows]
    assert facts["frames"] == max(map(len, clips)) == stage.GetEndTimeCode() + 1
    assert (facts["characters"], facts["rate"]) == (3, 30.0)
    for index, clip in enumerate(clips):
        for frame in (0, 13, len(clip) - 1):
            expected = clip.positions()[frame]
            assert np.abs(world_joints(stage, index, frame) - expected).max() < NEAR
    # The negative control: another character is elsewhere.
    assert np.abs(world_joints(stage, 0, 13) - clips[2].positions()[13]).max() > 0.5


def test_a_character_stands_where_its_script_begins_and_keeps_its_last_pose(models, rows, tmp_path):
    crowd = PerformanceCrowd((models,), tmp_path / "crowd.usdc")
    performance_crowd.write(crowd, rows)
    stage = Usd.Stage.Open(str(crowd.path))
    for index, script in enumerate(SCRIPTS):
        matrix = stage.GetAttributeAtPath(f"/Crowd/Characters/c{index:05}.xformOp:transform").Get()
        start = script.get("start", {"position": [0.0, 0.0], "heading": 0.0})
        left, forward = start["position"]
        assert np.allclose(matrix.ExtractTranslation(), (left, 0.0, forward))
        ahead = matrix.TransformDir((0.0, 0.0, 1.0))
        assert np.isclose(np.arctan2(ahead[0], ahead[2]), start["heading"])
    last = len(performed(models, rows[0].question).clip) - 1
    assert stage.GetEndTimeCode() > last
    kept = world_joints(stage, 0, stage.GetEndTimeCode())
    assert np.array_equal(kept, world_joints(stage, 0, last))
    assert not np.array_equal(kept, world_joints(stage, 0, last - 1))
    said = stage.GetRootLayer().customLayerData["posefield"]
    assert list(said["scripts"]) == ["first", "far", "aside"]
    assert list(said["models"]) == [open_models((models,)).find("walk").identity]
    durations = [performed(models, row.question).trust.duration for row in rows]
    assert np.allclose(said["durations"], durations)
    # The stage complies, with bodies.
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    assert has_body(stage)
    assert [each.GetName() for each in context.Validate(stage)] == []


@pytest.mark.system
def test_processes_give_the_same_bytes(models, rows, tmp_path):
    found = []
    view = LevelCriteria(Camera(np.array([0.0, 2.0, -6.0]), 1.0, 1080.0), 1.0, None, None)
    for workers in (1, 2, 3):
        folder = tmp_path / str(workers)
        folder.mkdir()
        for ending in ("usd", "usdc"):
            crowd = PerformanceCrowd((models,), folder / f"crowd.{ending}", view)
            performance_crowd.write(crowd, rows, workers)
        found.append(exporting.content(folder))
    assert found[0] == found[1] == found[2] and len(found[0]) == 7


VIEW = LevelCriteria(Camera(np.array([0.0, 1.6, -3.0]), 1.0, 1080.0), 4.0, None, None)


def test_levels_are_the_coarsest_that_the_view_allows(models, rows, tmp_path):
    find = open_models((models,)).find
    levels = []
    for row in rows:
        answer, level = performance_crowd.perform_at_level(row.question, find, VIEW, 1000)
        script = resolve_script(row.question, find)
        errors = performance_crowd.level_errors(script)
        card = find("walk").session.card
        assert errors.tolist() == [each.pose for each in card.levels]
        radius = performance_crowd.body_radius(script)
        scale = pixels_per_metre(VIEW.camera, answer.clip.root_path, radius).max()
        assert level == 0 or errors[level] * scale <= VIEW.pixels
        # A coarser level would be seen, within what the path differs by.
        assert level + 1 == len(errors) or errors[level + 1] * scale > 0.95 * VIEW.pixels
        levelled = structs.replace(row.question, level=level)
        assert np.array_equal(performed(models, levelled).clip.rotations, answer.clip.rotations)
        levels.append(level)
    assert min(levels) < max(levels)
    crowd = PerformanceCrowd((models,), tmp_path / "crowd.usdc", VIEW)
    facts = performance_crowd.write(crowd, rows)
    assert facts["level_counts"] == np.bincount(levels, minlength=len(errors)).tolist()
    assert sum(facts["level_shares"]) == pytest.approx(1.0, abs=1e-3)
    stage = Usd.Stage.Open(str(crowd.path))
    for index, level in enumerate(levels):
        said = stage.GetAttributeAtPath(f"/Crowd/Motions/m{index:05}.posefield:level")
        assert [said.Get(time) for time in said.GetTimeSamples()] == [level]


FAULTS = {
    "another rate": ({"segments": [WALK], "fps": 24}, "fps: 24, expected 30 as in scripts.jsonl:1"),
    "another skeleton": (
        {"segments": [{"kind": "act", "model": "reach"}]},
        "character: another skeleton than in scripts.jsonl:1, expected the same",
    ),
    "another unit": ({"segments": [WALK], "unit": "cm"}, "unit: 'cm', expected 'm' for a crowd"),
    "a level": ({"segments": [WALK], "level": 1}, "level: 1, expected none: the camera chooses it"),
    "too near": ({"segments": [WALK], "start": {"position": [0.0, -3.0]}}, "camera: 0."),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_script_that_does_not_fit_is_named_and_nothing_is_written(name, models, tmp_path):
    script, said = FAULTS[name]
    rows = written(tmp_path, [SCRIPTS[0], script])
    crowd = PerformanceCrowd((models,), tmp_path / "out" / "crowd.usd", VIEW)
    with pytest.raises(InvalidField) as caught:
        performance_crowd.write(crowd, rows)
    assert str(caught.value).splitlines()[1].startswith(f"  scripts.jsonl:2: {said}")
    assert not crowd.path.parent.exists()


def test_the_command_writes_a_crowd(posefield, rows, models, tmp_path):
    out = tmp_path / "crowd.usdz"
    words = ("perform", tmp_path / "scripts.jsonl", "--crowd", "--model", models, "-o", out)
    words = (*words, "--workers", 1, "--camera", "0,1.6,-3", "--pixels", 4, "--body", "none")
    code, said, _ = posefield(*words, "--json")
    found = json.loads(said)
    assert code == 0 and found["file"] == str(out) and sum(found["level_counts"]) == 3
    code, said, _ = posefield(*words)
    assert code == 0 and said.startswith(f"{out}: 3 characters, ")
    count = found["level_counts"][0]
    assert f"{count} at level 0" in said
    stage = Usd.Stage.Open(str(out))
    assert not has_body(stage)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("scripts.jsonl", "--crowd"), "output: none, expected a file for the crowd"),
        (("scripts.jsonl", "--crowd", "-o", "out"), "'out' ends in none of usd, usda, usdc, usdz"),
        (("scripts.jsonl", "--crowd", "-o", "a.usd", "--pixels", 2), "pixels: given without a cam"),
        (("scripts.jsonl", "-o", "a", "--camera", "1,2,3"), "camera: given without --crowd"),
        (("one.json", "--crowd", "-o", "a.usdc"), "crowd: given for one script, expected a folder"),
    ],
)
def test_options_that_do_not_fit_are_refused(posefield, rows, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.json").write_text(json.dumps(SCRIPTS[0]))
    code, _, told = posefield("perform", *words)
    assert code == 2 and said in told
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.json", "scripts.jsonl"]
