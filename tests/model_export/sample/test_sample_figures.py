"""Tests of the procedural quadruped and hand: what they promise, and reproducible files."""

import numpy as np
import pytest

from posefield.common.errors import FileError
from posefield.motion import foot_skate
from posefield.roles import joint_recognition
from posefield_train.sample import sample_files
from posefield_train.sample.figures import hand_grip, quadruped_walk
from posefield_train.source import ingest, recipe
from posefield_train.source.canonical import placement
from posefield_train.source.rigs import facing

PAWS = [quadruped_walk.NAMES.index(paw) for paw in quadruped_walk.PAWS]
# Bones keep their length within rounding, m.
EXACT = 1e-9
# A paw that has just begun to lift counts as planted, m/s.
STILL = 1e-4


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Function that writes a family and returns its recipe, its examples and notes."""

    def of(family):
        folder = tmp_path_factory.mktemp("figures") / "family"
        file = sample_files.write_folder(folder, family.files())
        own = recipe.read(file)
        return own, *ingest.ingest(own, folder)

    return of


def test_the_paws_stand_while_the_animal_walks():
    for animal, clip in quadruped_walk.strides():
        paws = clip.positions()[:, PAWS]
        assert foot_skate.mean_skate_speed(paws, clip.rate) < STILL
        swings = np.ptp(paws[..., 1], axis=0)
        assert swings.min() > 0.05 * quadruped_walk.ANIMALS[animal]
        # Three paws stand most of the time, two at least.
        low = paws[..., 1] < paws[..., 1].min(axis=0) + EXACT
        assert low.sum(axis=1).min() >= 2 and np.mean(low) > 0.6


def test_knees_bend_forwards_and_elbows_backwards():
    clip = quadruped_walk.walk_stride("hound", 0.8, 0.0)
    places = dict(zip(quadruped_walk.NAMES, np.moveaxis(clip.positions(), 1, 0), strict=True))
    for leg in quadruped_walk.LEGS:
        upper, lower, paw = (places[name][:, 2] for name in leg.joints)
        ahead = np.mean(lower - 0.5 * (upper + paw))
        assert (ahead > 0.02) == (leg.ahead == 0.0) and abs(ahead) > 0.02


def test_the_last_pose_of_a_stride_leads_into_the_first():
    clip = quadruped_walk.walk_stride("fox", 0.8, 0.3)
    assert np.abs(clip.rotations[0, 1:7] - clip.rotations[-1, 1:7]).max() < 0.02
    height = clip.positions()[[0, -1], :, 1]
    assert np.abs(height[0] - height[1]).max() < 0.01


def test_the_files_face_as_the_recipe_says_and_nothing_else_tells_it(read):
    own, examples, notes = read(quadruped_walk)
    assert (own.motion.facing, examples[0].facing, notes) == ("-x", -90.0, [])
    names, parents = examples[0].clip.skeleton.names, examples[0].clip.skeleton.parents
    assert not [role for role in joint_recognition.roles_of(names, parents) if "Leg" in role]
    speeds = sorted({round(float(example.controls[0]), 1) for example in examples})
    assert speeds[0] < 0.6 and speeds[-1] > 1.1 and len(examples) == 24
    for example in examples:
        way = example.clip.root_path[-1] - example.clip.root_path[0]
        assert way[2] > 0.4 and abs(way[0]) < 0.25
    head = examples[0].clip.positions()[:, names.index("head")]
    assert np.all(head[:, 2] > examples[0].clip.root_path[:, 2])


def test_a_thinner_object_closes_the_hand_further():
    rng = np.random.default_rng
    tips = [hand_grip.NAMES.index(name) for name in ("index3", "middle3", "ring3")]
    ways = []
    for width in hand_grip.WIDTHS:
        last = hand_grip.grip("ben", width, 0.1, rng(3)).positions()[-1]
        ways.append(np.linalg.norm(last[tips] - last[0], axis=-1).mean())
    assert np.all(np.diff(ways) > 0.0)


def test_the_hand_has_no_facing_and_two_sizes(read):
    own, examples, notes = read(hand_grip)
    assert (own.motion.facing, examples[0].facing, notes) == ("none", None, [])
    sizes = {e.row.performer: np.linalg.norm(e.offsets, axis=1).sum() for e in examples}
    assert sizes["ann"] / sizes["ben"] == pytest.approx(0.92, abs=1e-6)
    assert len(examples[0].clip.skeleton) == 16


@pytest.mark.parametrize("family", [quadruped_walk, hand_grip])
def test_every_call_writes_the_same_bytes(family, tmp_path):
    assert family.files() == family.files()
    folder = tmp_path / "family"
    assert sample_files.write_folder(folder, family.files()) == folder / "recipe.toml"
    assert sample_files.write_folder(folder, family.files()).exists()
    (folder / "clips.csv").write_text("file\n")
    with pytest.raises(FileError, match=r"clips\.csv differs"):
        sample_files.write_folder(folder, family.files())


def test_the_quadruped_in_its_own_basis_is_the_one_that_faces_ahead(read):
    _, examples, _ = read(quadruped_walk)
    animal, clip = next(quadruped_walk.strides())
    straight = placement.canonicalize(clip, True, False)[0]
    first = next(e for e in examples if e.row.place.name == "stride_01.bvh")
    assert first.row.performer == animal
    # A file lists the joints depth first.
    order = [quadruped_walk.NAMES.index(joint) for joint in first.clip.skeleton.names]
    assert np.abs(first.clip.positions() - straight.positions()[:, order]).max() < 1e-5
    assert np.abs(facing.turn_basis(clip, 90.0).positions() - clip.positions()).max() > 0.1
