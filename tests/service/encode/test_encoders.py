import io
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import orjson
import pytest

from posefield.encode.character import CENTIMETRES, METRES, Convention
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import skeleton
from posefield_train.source import bvh


@pytest.fixture(scope="module")
def keyframes(walk):
    return orjson.loads(CLIP_ENCODERS["json"].encode(walk))


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


def words(answer):
    """Names of the joints as in BVH."""
    return [name.replace(" ", "_") for name in answer.clip.skeleton.names]


def test_bvh_is_in_centimetres(walk):
    file = bvh.loads(CLIP_ENCODERS["bvh"].encode(walk), "clip.bvh")
    clip = bvh.to_clip(file, metres_per_unit=0.01, up="y", root_offset="replace")
    # A BVH file lists joints depth first.
    order = [words(walk).index(name) for name in clip.skeleton.names]
    np.testing.assert_allclose(clip.positions(), walk.clip.positions()[:, order], atol=1e-5)


def positions(found):
    """Joints (F, J, 3) of JSON or npz."""
    rotations = np.array(found["rotations"], float)
    offsets = np.tile(np.array(found["bone_offsets"], float), (len(rotations), 1, 1))
    offsets[:, 0] = found["root_position"]
    return skeleton.forward_kinematics(tuple(found["parents"]), rotations, offsets)[0]


STAGE = Convention(0.01, "z")


def on_stage(points):
    """Points in centimetres with Z up, of metres with Y up."""
    return 100.0 * np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def test_json_and_npz_heed_the_convention_and_say_it(walk):
    text = orjson.loads(CLIP_ENCODERS["json"].encode(walk, STAGE))
    with np.load(io.BytesIO(CLIP_ENCODERS["npz"].encode(walk, STAGE))) as found:
        binary = dict(found)
    meant = on_stage(walk.clip.positions())
    for read in (text, binary):
        np.testing.assert_allclose(positions(read), meant, atol=1e-3)
    for units in (text["units"], orjson.loads(str(binary["units"]))):
        assert (units["length"], units["up"]) == ("centimetre", "Z")
    # Negative control: as usual it is elsewhere.
    usual = positions(orjson.loads(CLIP_ENCODERS["json"].encode(walk)))
    assert np.abs(usual - meant).max() > 10.0


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_bvh_with_z_up_is_read_back_as_the_same_clip(walk, unit):
    data = CLIP_ENCODERS["bvh"].encode(walk, Convention(unit, "z"))
    file = bvh.loads(data, "clip.bvh")
    clip = bvh.to_clip(file, metres_per_unit=unit, up="z", root_offset="replace")
    order = [words(walk).index(name) for name in clip.skeleton.names]
    np.testing.assert_allclose(clip.positions(), walk.clip.positions()[:, order], atol=1e-5)
    np.testing.assert_allclose(
        clip.skeleton.offsets[1:], walk.clip.translations[0, order[1:]], atol=1e-6
    )
    np.testing.assert_allclose(
        np.abs(np.sum(clip.rotations * walk.clip.rotations[:, order], axis=-1)), 1.0, atol=1e-9
    )
    lying = bvh.to_clip(file, metres_per_unit=unit, up="y", root_offset="replace")
    assert np.abs(lying.positions() - walk.clip.positions()[:, order]).max() > 0.1


@pytest.mark.parametrize(
    ("extension", "unit", "up", "meant"),
    [("bvh", None, None, CENTIMETRES), ("bvh", "m", None, METRES), ("usda", "cm", "z", STAGE)],
)
def test_what_is_not_asked_for_is_as_usual(extension, unit, up, meant):
    assert CLIP_ENCODERS[extension].convention(unit, up) == meant


@pytest.mark.parametrize("extension", CLIP_ENCODERS)
def test_threads_write_the_same_bytes(extension, walk, pose):
    encode = CLIP_ENCODERS[extension].encode
    expected = [encode(walk), encode(pose)] * 8
    with ThreadPoolExecutor(max_workers=4) as pool:
        assert list(pool.map(encode, [walk, pose] * 8)) == expected
