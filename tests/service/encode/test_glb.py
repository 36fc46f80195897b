"""Tests of glTF files with another library: positions of the joints and the skinned body."""

import dataclasses
import struct

import numpy as np
import pytest
from conftest import TRUST, answer, person
from pygltflib import GLTF2

from posefield.common.errors import InvalidField
from posefield.encode.files.file_convention import CENTIMETRES, Convention
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
    offsets[0] = clip.skeleton.offsets[0]
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
    assert file.asset.extras == {"posefield": walk.trust.facts()}


def test_neighbouring_quaternions_lie_in_one_hemisphere(file, walk):
    _, turns, _ = locals_of(file)
    assert (np.sum(turns[1:] * turns[:-1], axis=-1) > 0.0).all()
    # Negative control: those of the clip do not.
    own = walk.clip.rotations
    assert (np.sum(own[1:] * own[:-1], axis=-1) < 0.0).any()


def test_bones_that_keep_their_length_have_rotations_alone(file, walk):
    paths = [(c.target.node, c.target.path) for c in file.animations[0].channels]
    count = len(walk.clip.skeleton)
    assert paths == [*((joint, "rotation") for joint in range(count)), (0, "translation")]


def test_a_joint_that_slides_has_translations_too(walk):
    clip = walk.clip
    moves = clip.translations.copy()
    moves[:, 7, 1] += 0.1 * np.sin(np.arange(len(clip)))
    sliding = Clip(clip.skeleton, clip.rotations, moves, clip.rate)
    file = read(CLIP_ENCODERS["glb"].encode(ClipAnswer(sliding, walk.trust)))
    assert np.abs(matrices(file)[..., :3, 3] - sliding.positions()).max() < NEAR
    paths = [(c.target.node, c.target.path) for c in file.animations[0].channels]
    assert paths[-2:] == [(0, "translation"), (7, "translation")]


def test_faces_are_those_of_the_body(file):
    primitive = file.meshes[0].primitives[0]
    corners = values(file, primitive.indices).reshape(-1, 3)
    points = values(file, primitive.attributes.POSITION)
    normals = values(file, primitive.attributes.NORMAL)
    a, b, c = (points[corners[:, k]] for k in range(3))
    # Counter-clockwise from outside, as the normals of the corners point.
    outside = np.cross(b - a, c - a)
    agreeing = np.sum(outside * normals[corners].sum(axis=1), axis=-1) > 0.0
    assert agreeing.mean() > 0.99
    assert set(corners.ravel()) == set(range(len(points)))
    # A closed surface: every edge is gone along once in each direction.
    edges = np.concatenate([corners[:, [i, (i + 1) % 3]] for i in range(3)])
    there, back = {tuple(e) for e in edges.tolist()}, {tuple(e[::-1]) for e in edges.tolist()}
    assert there == back and len(there) == len(edges)


def test_bounds_are_those_of_the_numbers(file):
    for index in (file.meshes[0].primitives[0].attributes.POSITION, 0):
        accessor = file.accessors[index]
        if accessor.min is not None:
            assert np.array_equal(np.float32(accessor.min), values(file, index).min(axis=0))
            assert np.array_equal(np.float32(accessor.max), values(file, index).max(axis=0))
    assert file.accessors[file.animations[0].samplers[0].input].max is not None


def test_the_container_holds_a_text_and_a_buffer_and_nothing_else(walk):
    data = CLIP_ENCODERS["glb"].encode(walk)
    magic, version, length, text, kind = struct.unpack_from("<4s2L L4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    size, kind = struct.unpack_from("<L4s", data, 20 + text)
    assert (28 + text + size, kind) == (len(data), b"BIN\0")
    assert text % 4 == size % 4 == 0


def test_a_pose_is_a_clip_of_one_frame(pose):
    file = read(CLIP_ENCODERS["glb"].encode(pose))
    assert locals_of(file)[0].tolist() == [0.0]
    assert np.abs(matrices(file)[..., :3, 3] - pose.clip.positions()).max() < NEAR


def test_numbers_that_json_has_not_are_null(walk):
    unknown = dataclasses.replace(walk.trust, sigma=float("nan"))
    file = read(CLIP_ENCODERS["glb"].encode(dataclasses.replace(walk, trust=unknown)))
    assert file.asset.extras["posefield"]["sigma"] is None


@pytest.mark.parametrize(
    ("convention", "said"),
    [
        (CENTIMETRES, "unit: 0.01 m, expected 1 m: the law of glb"),
        (Convention(1.0, "z"), "up: 'z', expected 'y': the law of glb"),
    ],
)
def test_another_convention_is_refused(walk, convention, said):
    with pytest.raises(InvalidField) as caught:
        CLIP_ENCODERS["glb"].encode(walk, convention)
    assert str(caught.value) == said


def test_a_loop_in_place_ends_in_the_bytes_it_begins_with():
    """Whatever the signs of the quaternions in between."""
    made = answer(45, 30.0).clip
    turns, path = made.rotations.copy(), made.translations.copy()
    turns[-1], path[-1] = turns[0], path[0]
    closed = Clip(person(), turns, path, 30.0)
    _, found, moves = locals_of(read(CLIP_ENCODERS["glb"].encode(ClipAnswer(closed, TRUST))))
    assert np.array_equal(moves[0], moves[-1])
    assert np.array_equal(found[0], found[-1])
