"""Tests of `posefield crowd`: files, output and errors."""

import json
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdSkel
from typer.testing import CliRunner

from posefield import cli
from posefield.common.errors import FileError, FormError, InvalidField, UnknownFormat

ROUTES = Path(__file__).parent / "data/bad_routes.json"
PARTS = ("--people-per-file", 2, "--trajectories", "x.csv")


def run(*words):
    return CliRunner().invoke(cli.app, ["crowd", *map(str, words)])


def test_a_crowd_is_written_and_its_feet_are_told_of(walk_path, tmp_path):
    path = tmp_path / "crowd.npz"
    done = run(walk_path, "--count", 7, "--seconds", 2, "--seed", 1, "-o", path)
    assert done.exit_code == 0, done.output
    assert "7 characters, 61 frames at 30 a second, seed 1" in done.stdout
    assert "feet on the ground slide at" in done.stdout
    with np.load(path) as crowd:
        assert crowd["rotations"].shape == (7, 61, 7, 4)
        assert crowd["root_position"].shape == (7, 61, 3)
        assert crowd["bone_offsets"].shape == (7, 7, 3)
        assert crowd["rate"] == 30.0
        assert crowd["joints"][0] == "Hips"
        # In the world: nobody stands in another's place, and everybody gets on.
        floor = crowd["root_position"][..., [0, 2]]
        assert np.linalg.norm(floor[:, -1] - floor[:, 0], axis=-1).min() > 1.0
        apart = np.linalg.norm(floor[:, None, 0] - floor[:, 0], axis=-1) + 9.0 * np.eye(7)
        assert apart.min() > 0.8


def test_feet_stand_unless_asked_to_be_as_predicted(walk_path, tmp_path):
    told, written = {}, {}
    for words in ((), ("--feet", "as_predicted")):
        path = tmp_path / f"{len(told)}.npz"
        done = run(walk_path, "--count", 4, "--seconds", 3, "-o", path, "--json", *words)
        told[words], written[words] = json.loads(done.stdout), path.read_bytes()
    stood, free = told.values()
    assert stood["feet_stand"] and not free["feet_stand"]
    assert stood["skate_cm_per_s"] < 0.2 * free["skate_cm_per_s"]
    assert stood["skate_before_cm_per_s"] == pytest.approx(free["skate_cm_per_s"], abs=0.011)
    assert stood["drift_cm"] == 0.0 and 0.0 <= stood["lowered_cm"] <= 5.0
    assert not {"skate_before_cm_per_s", "drift_cm", "lowered_cm"} & free.keys()
    assert len(set(written.values())) == 2
    done = run(walk_path, "--count", 4, "--seconds", 1, "-o", path)
    assert "feet stand: as predicted they would slide at" in done.stdout


def test_takes_are_written_and_told_of(walk_path, tmp_path):
    written = []
    for words in ((), ("--take", "index"), ("--take", "index"), ("--take", 7, "--variety", 0.4)):
        path = tmp_path / f"{len(written)}.usda"
        done = run(walk_path, "--count", 3, "--seconds", 1, "-o", path, *words)
        assert done.exit_code == 0, done.output
        written.append(path.read_bytes())
    assert "take 7, variety 0.4" in done.stdout
    plain, own, again, one = written
    assert own == again and len({plain, own, one}) == 3
    stages = [Usd.Stage.Open(str(tmp_path / f"{place}.usda")) for place in (0, 1)]
    bare, data = (stage.GetRootLayer().customLayerData["posefield"] for stage in stages)
    assert data["take"] == {"seed": "index", "variety": pytest.approx(0.7), "detail": False}
    assert "take" not in bare
    assert isinstance(run(walk_path, "--take", "own", "-o", path).exception, FormError)


def test_labels_are_those_of_all_characters(walk_path, tmp_path):
    written = {}
    for words in ([], ["performer=ann"], ["performer=ann:0.5,ben:0.5"]):
        path = tmp_path / f"{len(written)}.npz"
        given = [part for word in words for part in ("--label", word)]
        done = run(walk_path, "--count", 5, "--seconds", 1, "-o", path, *given)
        assert done.exit_code == 0, done.output
        written[tuple(words)] = path.read_bytes()
    assert len(set(written.values())) == 3
    done = run(walk_path, "--label", "performer=bob", "-o", path)
    assert "labels/performer: 'bob', expected one of ann, ben" in str(done.exception)


def test_routes_are_followed(walk_path, tmp_path):
    routes = tmp_path / "routes.json"
    ways = (([[0, 0], [0, 4]], 1.0), ([[3, 4], [3, 0]], 1.2))
    routes.write_text(json.dumps([{"waypoints": way, "speed": speed} for way, speed in ways]))
    path = tmp_path / "crowd.npz"
    done = run(walk_path, "--paths", routes, "--seconds", 2, "-o", path, "--json")
    facts = json.loads(done.stdout)
    assert (facts["characters"], facts["frames"], len(facts["performers"])) == (2, 61, 2)
    assert 0.0 < facts["skate_cm_per_s"] < 1.3 * facts["skate_strides_cm_per_s"]
    with np.load(path) as crowd:
        gone = crowd["root_position"][:, -1] - crowd["root_position"][:, 0]
    assert gone[:, 2] == pytest.approx([2.0, -2.4], abs=0.1)


@pytest.mark.parametrize(
    ("words", "kind", "said"),
    [
        (("-o", "crowd.fbx"), UnknownFormat, "output: 'crowd.fbx' ends in none of usd, usda, usdc"),
        (("-o", "c.usd", "--camera", "1,2"), FormError, "camera: '1,2', expected x,y,z"),
        (("-o", "c.usd", "--seconds", "1e308"), InvalidField, "poses, expected"),
        (("-o", "c.npz", "--fps", 10, "--feet", "stand"), InvalidField, "feet: 'stand'"),
        (("-o", "c.npz", "--paths", "none.json"), FileError, "none.json: cannot be read"),
        (("-o", "c.npz", "--paths", __file__), FormError, "Expected `array`, got `str`"),
        (
            ("-o", "c.npz", "--paths", ROUTES),
            FormError,
            "0/waypoints/1: Expected `array` of length",
        ),
        (("-o", "c.npz", "-o", "d.osi", *PARTS), InvalidField, "c and d, expected one name"),
        (("-o", "c.npz", "--motions", 2, *PARTS), InvalidField, "motions: 2, expected none"),
        (("-o", "c.npz", "--paths", "x", "--count", 2), InvalidField, "count: 2, expected none"),
        (("-o", "c.npz", "--seconds", 10, *PARTS), InvalidField, "seconds: 10.0, expected none"),
        (("-o", "c.npz", "--y-down"), InvalidField, "y_down: True, expected none without traj"),
        (("-o", "c.npz", "--workers", 0), InvalidField, "workers: 0, expected none without peopl"),
        (("-o", "c.npz", "--instancing", "flatten"), InvalidField, "instancing: 'flatten', expec"),
    ],
)
def test_what_cannot_be_done_is_refused(walk_path, tmp_path, monkeypatch, words, kind, said):
    monkeypatch.chdir(tmp_path)
    done = run(walk_path, *words)
    assert isinstance(done.exception, kind)
    assert said in str(done.exception)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ["usda", "usdz"])
def test_a_crowd_is_written_as_usd(walk_path, tmp_path, ending):
    path = tmp_path / f"crowd.{ending}"
    words = ("--count", 6, "--motions", 2, "--seconds", 0.5, "-o", path, "--json")
    facts = json.loads(run(walk_path, *words).stdout)
    assert (facts["characters"], facts["motions"], facts["frames"]) == (6, 2, 16)
    stage = Usd.Stage.Open(str(path))
    characters = stage.GetPrimAtPath("/Crowd/Characters").GetChildren()
    played = [c.GetRelationship("skel:animationSource").GetTargets()[0] for c in characters]
    assert len(played) == 6 and len(set(played)) == 2
    animation = UsdSkel.Animation(stage.GetPrimAtPath(played[0]))
    first, last = (np.array(animation.GetRotationsAttr().Get(code)) for code in (0, 15))
    assert np.abs(first - last).max() > 0.05


def test_a_single_pose_alone_is_written_as_it_is(walk_path, tmp_path):
    """One character of one frame: nothing of it is turned while its box is sought."""
    paths = [tmp_path / f"one.{ending}" for ending in ("usdc", "npz")]
    outputs = ("-o", paths[0], "-o", paths[1])
    assert run(walk_path, "--count", 1, "--seconds", 0.001, *outputs).exit_code == 0
    stage = Usd.Stage.Open(str(paths[0]))
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/Crowd/Motions/m00000"))
    found = np.array(animation.GetRotationsAttr().Get(0))[:, [3, 0, 1, 2]]
    with np.load(paths[1]) as crowd:
        expected = crowd["rotations"][0, 0]
    # The root's is in the world there.
    assert np.abs(np.abs(np.sum(found * expected, axis=-1)[1:]) - 1.0).max() < 1e-5


def test_a_camera_chooses_levels_and_they_are_told(walk_path, tmp_path):
    words = ("--count", 9, "--seconds", 0.5, "--json", "-o", tmp_path / "crowd.usdc")
    shares = [
        json.loads(run(walk_path, *words, f"--camera={place}").stdout)["level_shares"]
        for place in ("-9,1.7,0", "-2000,1.7,0")
    ]
    assert [sum(share) for share in shares] == pytest.approx([1.0] * 2, abs=1e-3)
    finest = [share[0] for share in shares]
    assert finest == sorted(finest, reverse=True) and finest[-1] == 0.0


def test_a_model_that_does_not_walk_is_refused(model_path, tmp_path):
    assert isinstance(run(model_path, "-o", tmp_path / "c.npz").exception, InvalidField)
    assert not (tmp_path / "c.npz").exists()


def test_several_files_have_the_bytes_of_each_alone(walk_path, tmp_path):
    words, endings = ("--count", 2, "--seconds", 1), ("usdc", "npz", "arrow")
    outputs = [word for end in endings for word in ("-o", tmp_path / f"new/{end}/a.{end}")]
    files = json.loads(run(walk_path, *words, *outputs, "--json").stdout)["files"]
    assert files == [*map(str, outputs[1::2])]
    for file in outputs[1::2]:
        assert run(walk_path, *words, "-o", tmp_path / file.name).exit_code == 0
        assert file.read_bytes() == (tmp_path / file.name).read_bytes()
        assert len(list(file.parent.iterdir())) == 1
