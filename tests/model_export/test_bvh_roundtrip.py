"""Tests of writing and reading BVH, and of randomly damaged files."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from posefield.common.errors import BvhError
from posefield.motion import bvh_writer, quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import bvh

# Metres and radians, of each joint and of the end of a chain of 31 joints of a metre and more.
TOLERANCE = 1e-6

GOLDEN = b"""\
HIERARCHY
ROOT hips
{
	OFFSET 0.0000000 0.0000000 0.0000000
	CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
	End Site
	{
		OFFSET 0.0000000 0.0000000 -10.0000000
	}
	JOINT left_leg
	{
		OFFSET 10.0000000 -5.0000000 0.0000000
		CHANNELS 3 Zrotation Yrotation Xrotation
		JOINT foot:L
		{
			OFFSET 0.0000000 0.0000000 0.0000000
			CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
			End Site
			{
				OFFSET 0.0000000 -5.0000000 12.0000000
			}
			End Site
			{
				OFFSET 0.0000000 -5.0000000 -4.0000000
			}
		}
	}
	JOINT spine
	{
		OFFSET 0.0000000 20.0000000 0.0000000
		CHANNELS 3 Zrotation Yrotation Xrotation
		End Site
		{
			OFFSET 0.0000000 0.0000000 0.0000000
		}
	}
}
MOTION
Frames: 2
Frame Time: 0.03333333333
0.0000000 90.0000000 0.0000000 0.0000000 0.0000000 30.0000000 0.0000000 0.0000000 0.0000000 \
0.0000000 -40.0000000 0.0000000 0.0000000 -45.0000000 0.0000000 90.0000000 0.0000000 0.0000000
1.5000000 90.0000000 0.0000000 0.0000000 0.0000000 40.0000000 0.0000000 0.0000000 0.0000000 \
0.0000000 -40.0000000 1.0000000 0.0000000 -45.0000000 0.0000000 100.0000000 0.0000000 0.0000000
"""


def turn(axes, *degrees):
    return quat.from_euler(np.deg2rad(np.array(degrees, dtype=float)), axes)


def small_clip():
    """Four joints, not depth first, of which the foot slides; the spine has no tip."""
    offsets = np.array([[0, 0.9, 0], [0.1, -0.05, 0], [0, 0.2, 0], [0, -0.4, 0.005]])
    tips = np.array([[0, -0.05, 0.12], [0, 0, -0.1], [0, -0.05, -0.04]])
    names = ("hips", "left_leg", "spine", "foot:L")
    skeleton = Skeleton(names, (-1, 0, 0, 1), offsets, (3, 0, 3), tips)
    rotations = np.tile(quat.IDENTITY, (2, 4, 1))
    rotations[:, 0] = [turn("X", 30), turn("X", 40)]
    rotations[:, 2] = [turn("Z", 90), turn("Z", 100)]
    rotations[:, 3] = turn("Y", -45)
    translations = np.tile(offsets, (2, 1, 1))
    translations[1, 0, 0] = 0.015
    translations[:, 3, 2] = [0.0, 0.01]
    return Clip(skeleton, rotations, translations, 30.0)


def random_clip(rng, parents, frames=5, rate=30.0):
    """Return full random motion: every second joint slides, tips have random parents."""
    joints = len(parents)
    names = tuple(f"joint_{index}" for index in range(joints))
    owners = tuple(int(owner) for owner in rng.integers(0, joints, size=3))
    skeleton = Skeleton(
        names, parents, rng.normal(size=(joints, 3)), owners, rng.normal(size=(3, 3))
    )
    translations = np.tile(skeleton.offsets, (frames, 1, 1))
    translations[:, ::2] += rng.normal(size=translations[:, ::2].shape)
    rotations = quat.normalize(rng.normal(size=(frames, joints, 4)))
    return Clip(skeleton, rotations, translations, rate)


def returned(content, metres_per_unit):
    file = bvh.loads(content, "written.bvh")
    return bvh.to_clip(file, metres_per_unit=metres_per_unit, up="y", root_offset="add")


def angles_between(a, b):
    return np.linalg.norm(quat.log(quat.mul(quat.conj(a), b)), axis=-1)


def worst(clip, other):
    """Largest difference of local translations, world positions and local rotations."""
    order = [other.skeleton.names.index(name) for name in clip.skeleton.names]
    return max(
        np.abs(clip.translations - other.translations[:, order]).max(),
        np.abs(clip.positions() - other.positions()[:, order]).max(),
        angles_between(clip.rotations, other.rotations[:, order]).max(),
    )


def tip_places(skeleton):
    """Owner's name and offset of each tip that has a length, in a fixed order."""
    pairs = zip(skeleton.tip_joints, skeleton.tip_offsets, strict=True)
    return sorted(
        (skeleton.names[owner], tuple(offset)) for owner, offset in pairs if np.any(offset)
    )


def assert_returns(clip, metres_per_unit):
    other = returned(bvh_writer.dumps(clip, metres_per_unit=metres_per_unit), metres_per_unit)
    assert set(other.skeleton.names) == set(clip.skeleton.names)
    for joint, name in enumerate(clip.skeleton.names[1:], start=1):
        same = other.skeleton.names.index(name)
        parent = clip.skeleton.names[clip.skeleton.parents[joint]]
        assert other.skeleton.names[other.skeleton.parents[same]] == parent
    for (owner, offset), (same, read) in zip(
        tip_places(clip.skeleton), tip_places(other.skeleton), strict=True
    ):
        assert owner == same
        np.testing.assert_allclose(offset, read, rtol=0, atol=TOLERANCE)
    assert worst(clip, other) < TOLERANCE
    assert other.rate == pytest.approx(clip.rate, rel=1e-9)


@st.composite
def clips(draw):
    joints = draw(st.integers(1, 8))
    parents = (-1, *(draw(st.integers(0, joint - 1)) for joint in range(1, joints)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    clip = random_clip(rng, parents, draw(st.integers(1, 4)), draw(st.sampled_from(RATES)))
    quarter = st.sampled_from([-180.0, -90.0, -45.0, 0.0, 90.0, 90.0 - 1e-7, 90.0 + 1e-5, 180.0])
    angle = st.one_of(quarter, st.floats(-720, 720))
    count = len(clip) * joints * 3
    degrees = np.array(draw(st.lists(angle, min_size=count, max_size=count)))
    rotations = quat.from_euler(np.deg2rad(degrees).reshape(len(clip), joints, 3), "ZYX")
    return replace(clip, rotations=rotations)


RATES = (0.5, 24.0, 24000 / 1001, 30.0, 59.5, 60.0, 120.0, 1000.0)
UNITS = (0.001, 0.01, 0.0254, 0.05644, 0.3048, 1.0, 10.0)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(clips(), st.sampled_from(UNITS))
def test_any_clip_returns(clip, metres_per_unit):
    assert_returns(clip, metres_per_unit)


@pytest.mark.parametrize("middle", [90, 90 - 1e-9, -90 + 1e-6])
def test_gimbal_poses_return(middle):
    outer = np.deg2rad(np.linspace(-180, 180, 25))
    first, last = np.meshgrid(outer, outer)
    angles = np.stack([first, np.full_like(first, np.deg2rad(middle)), last], axis=-1)
    rotations = quat.from_euler(angles.reshape(-1, 1, 3), "ZYX")
    skeleton = Skeleton(("a",), (-1,), np.zeros((1, 3)), (), np.zeros((0, 3)))
    assert_returns(Clip(skeleton, rotations, np.zeros((len(rotations), 1, 3)), 60.0), 0.01)


@pytest.fixture
def rng():
    return np.random.default_rng(20261121)


def test_bytes_are_these():
    assert bvh_writer.dumps(small_clip(), metres_per_unit=0.01) == GOLDEN


@pytest.mark.parametrize("decimals", [7, 11])
def test_numbers_are_written_as_percent_f_writes_them(rng, decimals):
    # A float holds fifteen digits.
    values = rng.normal(size=(50, 7)) * 10.0 ** rng.integers(-9, 14 - decimals, (50, 7))
    values[0] = [0.0, -0.0, 1e-12, -1e-12, 10.0, 999.99999999, -0.5]
    rounded = np.round(values, decimals) + 0.0
    expected = "".join(
        " ".join(f"{number:.{decimals}f}" for number in row) + "\n" for row in rounded
    )
    assert bvh_writer.format_numbers(values, decimals).decode() == expected


def test_numbers_of_too_many_digits_are_refused():
    with pytest.raises(ValueError, match=r"numbers of up to 1e\+12, expected fewer digits"):
        bvh_writer.format_numbers(np.array([[1.0, -1e12]]), 7)


def nearest_by_hand(angles):
    """Each frame's nearer triple, one frame after another."""
    near = [angles[0]]
    for triple in angles[1:]:
        both = np.stack([triple, np.array([1.0, -1.0, 1.0]) * triple + np.pi])
        both += 2.0 * np.pi * np.round((near[-1] - both) / (2.0 * np.pi))
        near.append(both[np.argmin(np.sum((both - near[-1]) ** 2, axis=-1))])
    return np.array(near)


def test_angles_are_as_near_as_taking_one_frame_after_another(rng):
    wild = quat.exp(np.cumsum(rng.normal(0.0, 0.3, (2000, 3)), axis=0))
    angles = quat.to_euler(wild, "ZYX")
    found = bvh_writer.unwrap_euler(angles)
    assert np.abs(found - nearest_by_hand(angles)).max() < 1e-9
    assert np.abs(found - angles).max() > np.pi


def test_only_joints_that_slide_have_position_channels():
    clip = small_clip()
    still = clip.translations.copy()
    still[1, 3] = still[0, 3] + 1e-10
    for translations, channels in ((clip.translations, 6), (still, 3)):
        content = bvh_writer.dumps(replace(clip, translations=translations), metres_per_unit=0.01)
        joints = {joint.name: joint for joint in bvh.loads(content, "written.bvh").joints}
        assert len(joints["foot:L"].channels) == channels
        assert len(joints["spine"].channels) == 3


NAMES = {
    "Bip01 L Thigh": "Bip01_L_Thigh",
    "左　腕": "左_腕",
    "a\nb{c": "a_b_c",
    "": "_",
    "spine ": "spine__2",
    "mixamorig:Hips": "mixamorig:Hips",
}


@pytest.mark.parametrize(("name", "written"), NAMES.items())
def test_names_become_one_word_that_all_readers_keep_apart(name, written):
    clip = small_clip()
    skeleton = replace(clip.skeleton, names=("hips", name, "spine_", "foot"))
    content = bvh_writer.dumps(replace(clip, skeleton=skeleton), metres_per_unit=0.01)
    kept = replace(clip.skeleton, names=("hips", written, "spine_", "foot"))
    assert content == bvh_writer.dumps(replace(clip, skeleton=kept), metres_per_unit=0.01)
    assert f"JOINT {written}\n".encode() in content


@pytest.mark.parametrize(("part", "value"), [("rotations", np.nan), ("translations", np.inf)])
def test_numbers_that_are_not_finite_are_refused(part, value):
    clip = small_clip()
    broken = getattr(clip, part).copy()
    broken[1, 2, 0] = value
    with pytest.raises(ValueError, match="not finite"):
        bvh_writer.dumps(replace(clip, **{part: broken}), metres_per_unit=0.01)


@pytest.mark.parametrize("unit", [0.0, np.nan])
def test_a_unit_that_is_no_length_is_refused(unit):
    with pytest.raises(ValueError, match="expected a positive number"):
        bvh_writer.dumps(small_clip(), metres_per_unit=unit)


def swapped_outer(content):
    return content.replace(b"Zrotation Yrotation Xrotation", b"Xrotation Yrotation Zrotation")


def swapped_lengths(content):
    return content.replace(b"Xposition Yposition", b"Yposition Xposition")


def three_digits(content):
    head, data = content.split(b"MOTION\n")
    frames, time, *rows = data.decode().rstrip("\n").split("\n")
    cut = [" ".join(f"{float(word):.3f}" for word in row.split()) for row in rows]
    return head + "\n".join(["MOTION", frames, time, *cut]).encode()


def first_frame_twice(content):
    lines = content.split(b"\n")
    row = lines.index(b"MOTION") + 3
    return b"\n".join([*lines[: row + 1], lines[row], *lines[row + 2 :]])


@pytest.mark.parametrize("wrong", [swapped_outer, swapped_lengths, three_digits, first_frame_twice])
def test_wrong_bytes_miss_the_tolerance(rng, wrong):
    """Negative control: each of these is read without complaint and seen by the comparison."""
    clip = random_clip(rng, (-1, 0, 1, 1))
    content = bvh_writer.dumps(clip, metres_per_unit=0.01)
    assert worst(clip, returned(content, 0.01)) < TOLERANCE
    assert worst(clip, returned(wrong(content), 0.01)) > TOLERANCE


def broken(rng, content):
    """The file cut, or with a few bytes replaced, left out, doubled or moved."""
    kind = rng.integers(5)
    start, stop = sorted(int(at) for at in rng.integers(0, len(content), size=2))
    if kind == 0:
        return content[:stop]
    if kind == 1:
        return content[:start] + content[min(stop, start + 20) :]
    if kind == 2:
        lines = content.split(b"\n")
        one, two = rng.integers(len(lines), size=2)
        lines[one], lines[two] = lines[two], lines[one]
        return b"\n".join(lines)
    if kind == 3:
        return content[:stop] + content[start:]
    changed = bytearray(content)
    for at in rng.integers(0, len(content), size=rng.integers(1, 4)):
        changed[at] = rng.choice(list(b"{}\n\r \t0-.eE+:nN\0\xff\x83J"))
    return bytes(changed)


def test_broken_files_are_refused_or_read_but_nothing_else(rng):
    outcomes = {"read": 0, "refused": 0}
    for _ in range(1500):
        content = broken(rng, GOLDEN)
        try:
            file = bvh.loads(content, "broken.bvh")
        except BvhError as error:
            assert error.line is not None
            assert 1 <= error.line <= content.count(b"\n") + content.count(b"\r") + 2
            outcomes["refused"] += 1
            continue
        clip = bvh.to_clip(file, metres_per_unit=0.01, up="z", root_offset="add")
        assert np.all(np.isfinite(clip.positions()))
        outcomes["read"] += 1
    # Both ways out were taken: a reader that refuses everything would pass the loop above.
    assert min(outcomes.values()) > 50
