"""Tests of glTF files with another library: positions of the joints and the skinned body."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from pygltflib import GLTF2

from posefield.common.errors import InvalidField
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.question.results import ClipAnswer

# float32 keeps 1e-7 of a metre; a joint is at the end of ten of them.
NEAR = 2e-6
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}


def read(data):
    return GLTF2.load_from_bytes(data)


def values(file, index):
    """Elements (count, width) of an accessor."""
    accessor = file.accessors[index]
    view = file.bufferViews[accessor.bufferView]
    assert accessor.byteOffset % 4 == view.byteOffset % 4 == 0
    start, count = view.byteOffset + accessor.byteOffset, accessor.count * WIDTHS[accessor.type]
    kind = np.dtype(TYPES[accessor.componentType])
    assert accessor.byteOffset + count * kind.itemsize <= view.byteLength
    found = np.frombuffer(file.binary_blob(), kind, count, start)
    return found.reshape(accessor.count, -1)


def locals_of(file, order=(3, 0, 1, 2)):
    """Times, and translations and wxyz rotations of all joints in all frames."""
    joints, animation = file.skins[0].joints, file.animations[0]
    times = values(file, animation.samplers[0].input)[:, 0]
    moves = np.tile([file.nodes[j].translation for j in joints], (len(times), 1, 1))
    turns = np.full((len(times), len(joints), 4), np.nan)
    for channel in animation.channels:
        sampler = animation.samplers[channel.sampler]
        assert sampler.input == animation.samplers[0].input
        keys, joint = values(file, sampler.output), joints.index(channel.target.node)
        if channel.target.path == "rotation":
            turns[:, joint] = keys[:, order]
        else:
            moves[:, joint] = keys
    return times, turns, moves


def parents_of(file):
    parents = {child: at for at, node in enumerate(file.nodes) for child in node.children}
    return tuple(parents.get(joint, -1) for joint in file.skins[0].joints)


def matrices(file, **kwargs):
    """Joints in the world (F, J, 4, 4), for column vectors."""
    _, turns, moves = locals_of(file, **kwargs)
    local = np.zeros((*turns.shape[:-1], 4, 4))
    local[..., :3, :3], local[..., :3, 3], local[..., 3, 3] = quat.to_matrix(turns), moves, 1.0
    for joint, parent in enumerate(parents_of(file)):
        if parent >= 0:
            local[:, joint] = local[:, parent] @ local[:, joint]
    return local


@pytest.fixture(scope="module")
def file(walk):
    return read(CLIP_ENCODERS["glb"].encode(walk))


def test_joints_are_where_the_clip_has_them(file, walk):
    found = matrices(file)[..., :3, 3]
    assert np.abs(found - walk.clip.positions()).max() < NEAR


def test_quaternions_in_another_order_miss(file, walk):
    """Negative control."""
    found = matrices(file, order=(0, 1, 2, 3))[..., :3, 3]
    assert np.abs(found - walk.clip.positions()).max() > 1e5 * NEAR


def test_the_body_moves_with_its_joints(file, walk):
    attributes = file.meshes[0].primitives[0].attributes
    points = values(file, attributes.POSITION)
    owners = values(file, attributes.JOINTS_0)[:, 0]
    inverse = values(file, file.skins[0].inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    moved = matrices(file) @ inverse
    ends = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    found = np.einsum("fpij,pj->fpi", moved[:, owners], ends)[..., :3]
    clip = walk.clip
    places, turns = skeleton.forward_kinematics(
        clip.skeleton.parents, clip.rotations, clip.translations
    )
    offsets = clip.translations[0].copy()
    offsets[0] = file.nodes[0].translation
    arms = points - clip.skeleton.at_rest(offsets)[owners]
    expected = places[:, owners] + quat.rotate(turns[:, owners], arms)
    assert np.abs(found - expected).max() < NEAR
    assert np.abs(found[0] - points).max() > 0.01


def test_names_tree_times_and_facts_are_those_of_the_clip(file, walk):
    clip = walk.clip
    names = tuple(file.nodes[joint].name for joint in file.skins[0].joints)
    assert names == clip.skeleton.names
    assert parents_of(file) == clip.skeleton.parents
    assert np.abs(locals_of(file)[0] - np.arange(len(clip)) / clip.rate).max() < 1e-6
    assert file.asset.version == "2.0"
    assert file.asset.extras == {"posefield": json.loads(json.dumps(walk.trust.facts()))}


def test_each_clip_has_a_name_of_its_own(file, walk):
    later = replace(walk, clip=replace(walk.clip, translations=walk.clip.translations + 0.01))
    names = [file.animations[0].name, read(CLIP_ENCODERS["glb"].encode(later)).animations[0].name]
    assert names[0] == read(CLIP_ENCODERS["glb"].encode(walk)).animations[0].name != names[1]
    assert all(re.fullmatch(r"walk_speed1.25_turn_rate-0.5_[0-9a-f]{8}", own) for own in names)


def test_neighbouring_quaternions_lie_in_one_hemisphere(file, walk):
    _, turns, _ = locals_of(file)
    assert (np.sum(turns[1:] * turns[:-1], axis=-1) > 0.0).all()
    # Negative control: those of the clip do not.
    own = walk.clip.rotations
    assert (np.sum(own[1:] * own[:-1], axis=-1) < 0.0).any()


def test_a_joint_that_slides_has_translations_too(walk):
    clip = walk.clip
    moves = clip.translations.copy()
    moves[:, 7, 1] += 0.1 * np.sin(np.arange(len(clip)))
    sliding = Clip(clip.skeleton, clip.rotations, moves, clip.rate)
    file = read(CLIP_ENCODERS["glb"].encode(ClipAnswer(sliding, walk.trust)))
    assert np.abs(matrices(file)[..., :3, 3] - sliding.positions()).max() < NEAR
    paths = [(c.target.node, c.target.path) for c in file.animations[0].channels]
    assert paths[-2:] == [(0, "translation"), (7, "translation")]


@pytest.mark.parametrize(
    ("unit", "up", "said"),
    [
        ("cm", None, "unit: 0.01 m, expected 1 m: the law of glb"),
        (None, "z", "up: 'z', expected 'y': the law of glb"),
    ],
)
def test_another_convention_is_refused(unit, up, said):
    with pytest.raises(InvalidField) as caught:
        CLIP_ENCODERS["glb"].convention(unit, up)
    assert str(caught.value) == said
