import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import orjson
import pytest

from service.encode import ENCODERS
from service.motion import bvh, skeleton


def test_the_table_names_each_format_once():
    assert {key: found.media_type for key, found in ENCODERS.items()} == {
        "usda": "model/vnd.usda",
        "usdc": "application/octet-stream",
        "usdz": "model/vnd.usdz+zip",
        "json": "application/json",
        "bvh": "application/x-bvh",
    }
    assert all(found.extension == key for key, found in ENCODERS.items())


@pytest.fixture(scope="module")
def keyframes(walk):
    return orjson.loads(ENCODERS["json"].encode(walk))


def test_json_holds_the_clip(keyframes, walk):
    clip = walk.clip
    assert tuple(keyframes["names"]) == clip.skeleton.names
    assert tuple(keyframes["parents"]) == clip.skeleton.parents
    assert (keyframes["rate"], keyframes["frames"]) == (clip.rate, len(clip))
    np.testing.assert_allclose(keyframes["times"], np.arange(45) / 29.97, atol=1e-6)
    np.testing.assert_allclose(keyframes["rotations"], clip.rotations, atol=1e-6)
    np.testing.assert_allclose(keyframes["root_position"], clip.root_path, atol=1e-6)
    np.testing.assert_allclose(keyframes["bone_offsets"][1:], clip.translations[0, 1:], atol=1e-6)
    assert keyframes["bone_offsets"][0] == [0.0, 0.0, 0.0]


def test_json_is_enough_to_place_the_joints(keyframes, walk):
    offsets = np.tile(keyframes["bone_offsets"], (45, 1, 1))
    offsets[:, 0] = keyframes["root_position"]
    rotations = np.array(keyframes["rotations"])
    positions, _ = skeleton.forward(tuple(keyframes["parents"]), rotations, offsets)
    np.testing.assert_allclose(positions, walk.clip.positions(), atol=1e-5)


def test_json_states_its_units_and_trust(keyframes, walk):
    assert keyframes["units"]["rotation"].startswith("unit quaternion w x y z")
    assert keyframes["trust"] == walk.trust.facts()


def test_json_never_holds_nan(walk):
    unknown = dataclasses.replace(walk.trust, sigma=float("nan"))
    data = ENCODERS["json"].encode(dataclasses.replace(walk, trust=unknown))
    assert orjson.loads(data)["trust"]["sigma"] is None


def test_bvh_is_in_centimetres(walk):
    file = bvh.loads(ENCODERS["bvh"].encode(walk), "clip.bvh")
    clip = bvh.to_clip(file, metres_per_unit=0.01, up="y", root_offset="replace")
    # A BVH file lists joints depth first.
    order = [walk.clip.skeleton.names.index(name) for name in clip.skeleton.names]
    np.testing.assert_allclose(clip.positions(), walk.clip.positions()[:, order], atol=1e-5)


@pytest.mark.parametrize("extension", ENCODERS)
def test_threads_write_the_same_bytes(extension, walk, pose):
    encode = ENCODERS[extension].encode
    expected = [encode(walk), encode(pose)] * 8
    with ThreadPoolExecutor(max_workers=4) as pool:
        assert list(pool.map(encode, [walk, pose] * 8)) == expected
