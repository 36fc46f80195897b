"""Tests of the character at rest: body of the clips, bones of any length, coarse faces."""

import json
import struct

import conftest
import numpy as np
import pytest

from posefield.encode import character, glb
from posefield.encode.formats import CLIP_ENCODERS, METRES

KINDS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def document(content):
    """The document and the buffer of a binary glTF file."""
    (length,) = struct.unpack_from("<L", content, 12)
    return json.loads(content[20 : 20 + length]), content[28 + length :]


def array(content, index):
    """One accessor of a file."""
    said, buffer = document(content)
    accessor = said["accessors"][index]
    view = said["bufferViews"][accessor["bufferView"]]
    kind, width = KINDS[accessor["componentType"]], WIDTHS[accessor["type"]]
    start = view["byteOffset"] + accessor.get("byteOffset", 0)
    found = np.frombuffer(buffer, kind, accessor["count"] * width, start)
    return found.reshape(-1, width)


def part(content, name, mesh=0):
    """An attribute, or the corners, of a mesh of a file."""
    (primitive,) = document(content)[0]["meshes"][mesh]["primitives"]
    return array(content, primitive["attributes"].get(name, primitive["indices"]))


@pytest.fixture(scope="module")
def person():
    return conftest.person()


@pytest.fixture(scope="module")
def content(person):
    return glb.character_glb(person, "reach@0123456789abcdef")


@pytest.mark.parametrize("name", ["NORMAL", "JOINTS_0", "WEIGHTS_0", "corners"])
def test_the_body_is_that_of_the_clips(walk, name):
    clip = CLIP_ENCODERS["glb"].encode(walk, METRES)
    rest = glb.character_glb(walk.clip.skeleton, "walk@0123456789abcdef")
    assert np.array_equal(part(rest, name), part(clip, name))
    assert not np.array_equal(part(rest, "POSITION"), part(rest, "NORMAL"))


def test_anchors_fit_the_body_to_other_bones(person, content):
    longer = person.offsets * np.linspace(0.8, 1.3, len(person))[:, None]
    rest = character.rest_pose(character.rig(person), longer[None])
    wanted, longer[0] = rest.points[0], rest.offsets[0, 0]
    moved = person.at_rest(longer - person.offsets)
    anchors, share = part(content, "_ANCHORS"), part(content, "_SHARE")
    points = part(content, "POSITION")
    start, end = moved[anchors[:, 0]], moved[anchors[:, 1]]
    np.testing.assert_allclose(points + start + share * (end - start), wanted, atol=1e-6)
    assert np.abs(points + start - wanted).max() > 0.01


def test_the_coarse_mesh_has_the_same_points(content):
    fine, coarse = (document(content)[0]["meshes"][mesh]["primitives"][0] for mesh in (0, 1))
    assert fine["attributes"] == coarse["attributes"]
    corners = part(content, "corners", mesh=1)
    assert len(corners) == 3 * 300
    assert len(part(content, "corners")) > 4 * len(corners)
    assert set(corners.flat) < set(part(content, "corners").flat)
