"""Tests of poses and clips as tables, with the clients' readers."""

import dataclasses
import io
import json
import zipfile

import msgpack
import numpy as np
import orjson
import pyarrow as pa
import pytest

from posefield.encode import table as tables
from posefield.encode.formats import CLIP_ENCODERS, POSE_ENCODERS
from posefield.encode.table import npz_archive
from posefield.question.results import PoseAnswer

ROWS = ("times", "rotations", "root_position")


@pytest.fixture(scope="module")
def posed(walk) -> PoseAnswer:
    clip = walk.clip
    turns = clip.rotations[:7].astype(np.float32).astype(float)
    path = clip.root_path[:7].astype(np.float32).astype(float)
    bones = clip.translations[0].astype(np.float32).astype(float)
    return PoseAnswer(np.linspace(0.0, 0.7, 7), turns, path, bones, walk.trust)


def by_json(content):
    return orjson.loads(content)


def by_msgpack(content):
    found = msgpack.unpackb(content)
    for name, value in found.items():
        if isinstance(value, dict) and value.keys() == {"dtype", "shape", "data"}:
            found[name] = np.frombuffer(value["data"], value["dtype"]).reshape(value["shape"])
    return found


def by_npz(content):
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        found = dict(archive)
    texts = {n: json.loads(str(found[n])) for n in ("trust", "units") if n in found}
    return found | texts


def by_arrow(content):
    (batch,) = pa.ipc.open_stream(content)
    batch.validate(full=True)
    metadata = batch.schema.metadata.items()
    found = {k.decode().removeprefix("posefield."): json.loads(text) for k, text in metadata}
    for name in batch.schema.names:
        column = batch.column(name)
        tensor = isinstance(column.type, pa.FixedShapeTensorType)
        found[name] = column.to_numpy_ndarray() if tensor else np.asarray(column)
    return found


READERS = {"json": by_json, "msgpack": by_msgpack, "npz": by_npz, "arrow": by_arrow}


@pytest.mark.parametrize("extension", READERS)
def test_every_number_of_a_pose_comes_back(extension, posed):
    found = READERS[extension](POSE_ENCODERS[extension].encode(posed))
    for name in (*ROWS, "bone_offsets"):
        # What JSON spells with the fewest digits is the same number only as float32.
        read = np.array(found[name], np.float64 if name == "times" else np.float32)
        assert np.array_equal(read, getattr(posed, name)), name
    assert found["trust"] == json.loads(json.dumps(posed.trust.document()))
    other = dataclasses.replace(posed, rotations=posed.rotations[::-1])
    changed = READERS[extension](POSE_ENCODERS[extension].encode(other))
    assert not np.array_equal(np.array(changed["rotations"]), np.array(found["rotations"]))


@pytest.mark.parametrize("extension", ["msgpack", "arrow", "npz"])
def test_a_clip_holds_what_its_json_does(extension, walk):
    plain = by_json(CLIP_ENCODERS["json"].encode(walk))
    found = READERS[extension](CLIP_ENCODERS[extension].encode(walk))
    assert found.keys() == plain.keys() - {"frames"}
    for name in (*ROWS, "bone_offsets"):
        np.testing.assert_allclose(np.array(found[name], float), plain[name], atol=2e-6)
    assert np.array_equal(found["names"], plain["names"])
    assert np.array_equal(found["parents"], plain["parents"])
    assert (found["rate"], found["units"], found["trust"]) == (
        plain["rate"],
        plain["units"],
        plain["trust"],
    )
    # Negative control: another frame is farther than rounding.
    assert np.abs(np.array(found["rotations"])[1] - plain["rotations"][0]).max() > 1e-4


def test_large_arrays_are_written_in_pieces_that_do_not_show():
    rng = np.random.default_rng(4)
    content = {
        "long": rng.standard_normal(3 * tables.JSON_BLOCK + 1).astype(np.float32),
        "deep": rng.standard_normal((tables.JSON_BLOCK // 8, 5, 4)),
        "wide": rng.standard_normal((3, tables.JSON_BLOCK)),
        "whole": rng.integers(0, 9, tables.JSON_BLOCK + 7, dtype=np.int8),
        "true": rng.random(tables.JSON_BLOCK + 1) < 0.5,
        "empty": np.zeros((0, 4)),
        "name": '"quoted"',
    }
    expected = orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)
    assert tables.json_object(content) == expected
    assert tables.json_object({}) == b"{}"


ARRAYS = {
    "matrix": np.arange(6.0).reshape(2, 3),
    "columns first": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "every second": np.arange(6)[::2],
    "empty": np.zeros((0, 3), np.float32),
    "big endian": np.arange(3, dtype=">f4"),
    "truths": np.array([True, False]),
    "number": np.array(1.5),
    "text": np.array("a"),
    "texts": np.array(["ab", "c"]),
}


def test_npz_has_the_bytes_of_zipfile_and_numpy():
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as made:
        for name, values in ARRAYS.items():
            member = zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0))
            member.create_system, member.external_attr = 3, 0o644 << 16
            with made.open(member, "w") as file:
                np.lib.format.write_array(file, values, allow_pickle=False)
    assert npz_archive(ARRAYS) == stream.getvalue()
