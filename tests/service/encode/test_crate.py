import numpy as np
import pytest
from pxr import Sdf

from service.encode import crate, layers, specs
from service.encode.specs import Type

SHAPES = {"translations": (7, 5, 3), "rotations": (7, 5, 4)}


@pytest.fixture
def samples(rng):
    return {name: rng.standard_normal(shape).astype("f4") for name, shape in SHAPES.items()}


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def ordinary(samples):
    made = Sdf.Layer.CreateAnonymous("moves.usdc")
    prim = specs.prim(made, "Anim", "SkelAnimation")
    moves = specs.attribute(prim, "translations", Type.Float3Array).path
    turns = specs.attribute(prim, "rotations", Type.QuatfArray).path
    specs.samples(made, moves, specs.vector_frames(samples["translations"]))
    specs.samples(made, turns, specs.quaternion_frames(samples["rotations"]))
    return layers.crate(made)


def last(samples):
    """The same as it is in memory: USD keeps the real part last."""
    return samples | {"rotations": np.roll(samples["rotations"], -1, axis=-1)}


def stored(samples):
    return ordinary(samples | {"rotations": np.roll(samples["rotations"], 1, axis=-1)})


def test_a_template_writes_what_usd_writes(samples):
    made = crate.template(stored, SHAPES)
    assert made is not None
    assert made.write(last(samples)) == ordinary(samples)
    # The real part at the wrong end would be seen.
    assert made.write(samples) != ordinary(samples)


@pytest.mark.parametrize("frames", [1, 2])
def test_few_frames_will_do(frames, samples):
    shapes = {name: (frames, *shape[1:]) for name, shape in SHAPES.items()}
    short = {name: value[:frames] for name, value in samples.items()}
    made = crate.template(stored, shapes)
    assert made is not None
    assert made.write(last(short)) == ordinary(short)


def test_a_template_is_not_changed_by_what_it_writes(samples):
    made = crate.template(stored, SHAPES)
    first = made.write(samples)
    made.write({name: value + 1 for name, value in samples.items()})
    assert made.write(samples) == first


def test_equal_samples_are_read_back_though_usd_would_write_them_once(samples, tmp_path):
    still = {name: np.broadcast_to(value[:1], value.shape) for name, value in samples.items()}
    data = crate.template(stored, SHAPES).write(last(still))
    assert len(data) > len(ordinary(still))
    path = tmp_path / "still.usdc"
    path.write_bytes(data)
    found = Sdf.Layer.FindOrOpen(str(path))
    for frame in range(7):
        turns = np.array(found.QueryTimeSample("/Anim.rotations", frame))
        np.testing.assert_array_equal(turns, last(still)["rotations"][frame])


# Ways to write that a template must not be made of, as bytes that need no USD.
def changed(samples):
    return b"head" + b"".join((-value).tobytes() for value in samples.values())


def twice(samples):
    return b"head" + b"".join(value.tobytes() * 2 for value in samples.values())


def uneven(samples):
    values = (value for array in samples.values() for value in array)
    return b"".join(value.tobytes() + b"." * index for index, value in enumerate(values))


def derived(samples):
    """Even and unique, but with something at the end that hangs on the samples."""
    return even(samples) + samples["translations"].max().tobytes()


def cut(samples):
    return even(samples)[:-1]


def even(samples):
    return b"head" + b"".join(value.tobytes() for value in samples.values())


@pytest.mark.parametrize("write", [changed, twice, uneven, derived, cut])
def test_what_cannot_be_trusted_is_written_the_ordinary_way(write, samples):
    assert crate.template(write, SHAPES) is None
    assert crate.writer(write, SHAPES)(samples) == write(samples)


def test_what_can_be_trusted_is_not(samples):
    assert crate.template(even, SHAPES) is not None
    assert crate.writer(even, SHAPES)(samples) == even(samples)
