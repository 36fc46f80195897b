"""Tests of crowd poses in every format, with the clients' readers."""

import io
import json

import msgpack
import numpy as np
import orjson
import pyarrow as pa
import pytest

from posefield.encode.formats import CROWD_ENCODERS
from posefield.motion import quat
from posefield.motion.clip import CrowdPoses

TENSORS = ("rotations", "root_position", "bone_offsets")
NUMBERS = ("duration", "sigma", "supported", "levels", "error_px")
TYPES = {"levels": np.int8, "supported": np.bool_}


def crowd(skeleton, characters):
    rng = np.random.default_rng(11)

    def singles(*shape):
        return rng.normal(size=(characters, *shape)).astype(np.float32)

    joints = len(skeleton)
    return CrowdPoses(
        model="walk@0123abcd",
        skeleton=skeleton,
        rotations=quat.normalize(singles(joints, 4)),
        root_position=singles(3),
        bone_offsets=singles(joints, 3),
        levels=rng.integers(0, 6, characters),
        error_px=np.abs(singles()),
        duration=np.abs(singles()),
        sigma=np.abs(singles()),
        supported=rng.random(characters) < 0.5,
        warnings=("speed lies outside what was sampled for 3 characters, of whom 7 is the first",),
    )


@pytest.fixture(scope="module")
def poses(walk):
    return crowd(walk.clip.skeleton, 23)


def by_arrow(poses):
    reader = pa.ipc.open_stream(CROWD_ENCODERS["arrow"].encode(poses))
    (batch,) = reader
    batch.validate(full=True)
    found = {name: batch.column(name) for name in batch.schema.names}
    for name in TENSORS:
        found[name] = found[name].to_numpy_ndarray()
    columns = {name: np.asarray(column) for name, column in found.items()}
    metadata = {key.decode(): json.loads(text) for key, text in batch.schema.metadata.items()}
    return columns, {key.removeprefix("posefield."): value for key, value in metadata.items()}


def by_npz(poses):
    with np.load(io.BytesIO(CROWD_ENCODERS["npz"].encode(poses)), allow_pickle=False) as archive:
        arrays = dict(archive)
    known = ("model", "names", "parents", "units", "warnings")
    facts = {name: arrays.pop(name).tolist() for name in known}
    return arrays, facts | {"units": json.loads(facts["units"])}


def by_json(poses):
    content = orjson.loads(CROWD_ENCODERS["json"].encode(poses))
    facts = {name: content.pop(name) for name in ("model", "names", "parents", "units", "warnings")}
    types = dict.fromkeys(content, np.float32) | TYPES
    return {name: np.array(rows, types[name]) for name, rows in content.items()}, facts


def by_msgpack(poses):
    content = msgpack.unpackb(CROWD_ENCODERS["msgpack"].encode(poses))
    facts = {name: content.pop(name) for name in ("model", "names", "parents", "units", "warnings")}
    columns = {
        name: np.frombuffer(packed["data"], packed["dtype"]).reshape(packed["shape"])
        for name, packed in content.items()
    }
    return columns, facts


READERS = {"arrow": by_arrow, "npz": by_npz, "json": by_json, "msgpack": by_msgpack}


@pytest.mark.parametrize("extension", READERS)
def test_every_bit_comes_back(extension, poses):
    columns, _ = READERS[extension](poses)
    assert columns.keys() == {*TENSORS, *NUMBERS}
    for name in (*TENSORS, *NUMBERS):
        assert np.array_equal(columns[name], getattr(poses, name)), name
        assert columns[name].dtype == TYPES.get(name, np.float32), name
    assert not np.array_equal(columns["rotations"][::-1], poses.rotations)


def test_arrow_is_read_without_a_copy(poses):
    """The numbers that a client gets lie in the bytes that it received."""
    content = pa.py_buffer(CROWD_ENCODERS["arrow"].encode(poses))
    (batch,) = pa.ipc.open_stream(content)
    for name in TENSORS:
        address = batch.column(name).to_numpy_ndarray().ctypes.data
        assert content.address <= address < content.address + content.size
