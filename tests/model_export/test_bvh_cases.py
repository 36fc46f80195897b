"""Tests of unusual valid BVH files: each gives the correct joint positions.

The expected positions come from matrices, one channel at a time, over joints that the tests define
beside the file's text.
"""

import zipfile

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from posefield_train.source import bvh

# Both sides compute in float64 from the same decimals.
TOLERANCE = 1e-9

ZXY = "Zrotation Xrotation Yrotation"
XYZ_POSITION = "Xposition Yposition Zposition"

# What the text below says: a name, the parent, the OFFSET and the CHANNELS of each joint.
JOINTS = [
    ("hips", -1, (0, 0, 0), f"{XYZ_POSITION} {ZXY}"),
    ("spine", 0, (0, 10, 0), ZXY),
    ("head", 1, (1, 20, 2), ZXY),
    ("arm", 1, (-8, 3, 0.5), ZXY),
    ("hand", 3, (-12, 0, 1), ZXY),
]
ROWS = [
    [1, 92.5, 3, 10, 20, 30, -40, 50, 60, 70, -80, 85, 15, 25, -35, 5, 6, 7],
    [-1.5, 90, 4.25, 170, -20, 33, 44, 55, -66, 77, 8, 99, -11, 22, 133, 1, 2, 3],
]
PLAIN = """\
HIERARCHY
ROOT hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT head
    {
      OFFSET 1 20 2
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 15 1
      }
    }
    JOINT arm
    {
      OFFSET -8 3 0.5
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT hand
      {
        OFFSET -12 0 1
        CHANNELS 3 Zrotation Xrotation Yrotation
        End Site
        {
          OFFSET -5 0 0
        }
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
1 92.5 3 10 20 30 -40 50 60 70 -80 85 15 25 -35 5 6 7
-1.5 90 4.25 170 -20 33 44 55 -66 77 8 99 -11 22 133 1 2 3
"""


def local(offset, channels, values, add):
    """Local matrix of a joint: its positions replace the OFFSET's components, or follow them."""
    moved, turned = np.array(offset, dtype=float), np.eye(4)
    for channel, value in zip(channels, values, strict=True):
        if channel.lower().endswith("position"):
            axis = "XYZ".index(channel[0].upper())
            moved[axis] = value + (moved[axis] if add else 0.0)
        else:
            step = Rotation.from_euler(channel[0].upper(), value, degrees=True)
            turned[:3, :3] = turned[:3, :3] @ step.as_matrix()
    turned[:3, 3] = moved
    return turned


def world(joints, row, add_root=False):
    """World positions (J, 3) in the file's unit and axes."""
    frames, values = [], list(row)
    for _, parent, offset, channels in joints:
        count = len(channels.split())
        own = local(offset, channels.split(), values[:count], add_root and parent < 0)
        frames.append(own if parent < 0 else frames[parent] @ own)
        values = values[count:]
    return np.array([frame[:3, 3] for frame in frames])


def worlds(joints, rows, **kwargs):
    return np.array([world(joints, row, **kwargs) for row in rows])


def text_of(joints, rows):
    """Return the BVH text of joints, which must form a chain."""
    lines = ["HIERARCHY"]
    for name, parent, offset, channels in joints:
        count = len(channels.split())
        lines += [f"{'JOINT' if parent >= 0 else 'ROOT'} {name}", "{"]
        lines += ["OFFSET " + " ".join(map(str, offset)), f"CHANNELS {count} {channels}"]
    lines += ["}"] * len(joints)
    lines += ["MOTION", f"Frames: {len(rows)}", "Frame Time: 0.01"]
    return "\n".join(lines + [" ".join(map(str, row)) for row in rows]) + "\n"


def clip_of(content, up="y", root_offset="replace", metres_per_unit=1.0):
    content = content if isinstance(content, bytes) else content.encode()
    file = bvh.loads(content, "case.bvh")
    return bvh.to_clip(file, metres_per_unit=metres_per_unit, up=up, root_offset=root_offset)


def assert_positions(clip, expected):
    np.testing.assert_allclose(clip.positions(), expected, rtol=0, atol=TOLERANCE)


def assert_plain(content):
    clip = clip_of(content)
    assert_positions(clip, worlds(JOINTS, ROWS))
    return clip


def chain(*channels, rows, offsets=((0, 0, 0), (0, 10, 0), (3, 4, 5))):
    """Joints a, b, c in a chain, and the clip read from their file."""
    joints = [
        ("abc"[index], index - 1, offset, names)
        for index, (offset, names) in enumerate(zip(offsets, channels, strict=True))
    ]
    return joints, text_of(joints, rows)


def test_plain_file():
    clip = assert_plain(PLAIN)
    assert clip.skeleton.names == ("hips", "spine", "head", "arm", "hand")
    assert clip.skeleton.parents == (-1, 0, 1, 1, 3)
    assert clip.skeleton.tip_joints == (2, 4)
    np.testing.assert_array_equal(clip.skeleton.tip_offsets, [[0, 15, 1], [-5, 0, 0]])
    np.testing.assert_array_equal(clip.skeleton.offsets, [joint[2] for joint in JOINTS])
    assert clip.rate == 30.0


def stripped(text):
    """The text without indentation."""
    return "\n".join(line.strip() for line in text.split("\n"))


SPELLINGS = {
    "lines of old Macintoshes": lambda text: text.replace("\n", "\r"),
    "no final newline": lambda text: text.rstrip("\n"),
    "blank lines between frames": lambda text: text.replace("\n-1.5 90", "\n\n-1.5 90"),
    "several blanks": lambda text: stripped(text).replace(" ", " \t ").replace("\n", " \t \n"),
    "braces without blanks": lambda text: stripped(text).replace("\n{\n", "{"),
    "frames over several lines": lambda text: text.replace(" 10 20 30 -40", " 10 20\n30 -40"),
    "signs, exponents and bare points": lambda text: text.replace(
        "1 92.5 3 10", "+1. 9.25e1 .3E+1 1000e-2"
    ).replace("-8 3 0.5", "-.8e1 +3. .5"),
}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_spellings_of_the_same_file(spelling):
    text = SPELLINGS[spelling](PLAIN)
    assert text != PLAIN
    assert assert_plain(text).skeleton.names == ("hips", "spine", "head", "arm", "hand")


def test_words_in_any_case():
    text = PLAIN
    for name in [*ZXY.split(), *XYZ_POSITION.split()]:
        text = text.replace(name, name.upper())
    for word in ("HIERARCHY", "ROOT", "OFFSET", "JOINT", "End Site", "MOTION", "Frame Time"):
        text = text.replace(word, word.lower())
    assert_plain(text)


def test_encodings():
    clip = assert_plain(b"\xef\xbb\xbf" + PLAIN.encode())
    assert clip.skeleton.names[0] == "hips"
    # A byte of cp932 may be a brace.
    name = "センター ボーン"
    assert b"\x83{" in name.encode("cp932")
    clip = assert_plain(PLAIN.replace("hips", name).encode("cp932"))
    assert clip.skeleton.names[0] == name
    # Where neither Unicode nor cp932 decodes, names are in Latin-1.
    clip = assert_plain(PLAIN.replace("hips", "H\xfcfte \xff").encode("latin-1"))
    assert clip.skeleton.names[0] == "Hüfte ÿ"


@pytest.mark.parametrize("name", ["OFFSET_ctrl", "MOTION", "Frames: 3", "End Site"])
def test_names_that_hold_keywords(name):
    clip = assert_plain(PLAIN.replace("JOINT arm", f"JOINT {name}"))
    assert clip.skeleton.names[3] == name


def test_every_euler_order():
    for axes in ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"):
        names = " ".join(f"{axis}rotation" for axis in axes)
        joints, text = chain(names, names, "", rows=(rows := [[10, 80, -35, 121, -47, 63]]))
        assert_positions(clip_of(text), worlds(joints, rows))


def test_rotation_and_position_channels_mixed():
    mixed = "Zrotation Yposition Xrotation Zposition Yrotation Xposition"
    joints, text = chain(mixed, ZXY, "", rows=(rows := [[*range(7, 70, 7)]]))
    assert_positions(clip_of(text), worlds(joints, rows))


def test_no_one_and_two_rotation_channels():
    joints, text = chain(
        "Yrotation Xrotation", "", "Zrotation", rows=(rows := [[30, 40, 50], [60, 70, 80]])
    )
    assert_positions(clip_of(text), worlds(joints, rows))
    joints, text = chain(
        f"{XYZ_POSITION} Yrotation", "Xrotation", "", rows=(rows := [[1, 2, 3, 30, 40]])
    )
    assert_positions(clip_of(text), worlds(joints, rows))


def test_missing_position_channel_takes_the_offset():
    offsets = ((1, 90, 2), (0, 10, 0), (3, 4, 5))
    root, joint = f"Yposition {ZXY}", f"Xposition Zposition {ZXY}"
    rows = [[95, 10, 20, 30, 7, 8, 40, 50, 60]]
    joints, text = chain(root, joint, "", rows=rows, offsets=offsets)
    clip = clip_of(text)
    assert_positions(clip, worlds(joints, rows))
    np.testing.assert_array_equal(clip.translations[0, :2], [[1, 95, 2], [7, 10, 8]])
    added = clip_of(text, root_offset="add")
    assert_positions(added, worlds(joints, rows, add_root=True))
    np.testing.assert_array_equal(added.translations[0, :2], [[1, 185, 2], [7, 10, 8]])


def test_several_end_sites_on_one_joint_and_beside_children():
    site = "End Site\n{\nOFFSET 0 15 1\n}\n"
    more = site + "End Site\n{\nOFFSET 7 8 9\n}\n"
    text = stripped(PLAIN).replace(site, more)
    clip = assert_plain(text.replace("JOINT head", site + "JOINT head"))
    assert clip.skeleton.tip_joints == (1, 2, 2, 4)
    expected = [[0, 15, 1], [0, 15, 1], [7, 8, 9], [-5, 0, 0]]
    np.testing.assert_array_equal(clip.skeleton.tip_offsets, expected)


def test_z_up_stands_upright_and_moves_alike():
    turned = worlds(JOINTS, ROWS)[..., [0, 2, 1]] * [1, 1, -1]
    clip = clip_of(PLAIN, up="z")
    assert_positions(clip, turned)
    expected = np.array([joint[2] for joint in JOINTS])[:, [0, 2, 1]] * [1, 1, -1]
    np.testing.assert_array_equal(clip.skeleton.offsets, expected)
    np.testing.assert_array_equal(clip.skeleton.tip_offsets, [[0, 1, -15], [-5, 0, 0]])


def test_unit_scales_every_length_and_no_angle():
    clip = clip_of(PLAIN, metres_per_unit=0.01)
    assert_positions(clip, 0.01 * worlds(JOINTS, ROWS))
    np.testing.assert_allclose(clip.skeleton.offsets[1], [0, 0.1, 0])
    np.testing.assert_allclose(clip.skeleton.tip_offsets[0], [0, 0.15, 0.01])
    np.testing.assert_array_equal(clip.rotations, clip_of(PLAIN).rotations)


@pytest.mark.parametrize("unit", [-1.0, np.nan])
def test_a_unit_that_is_no_length_is_refused(unit):
    with pytest.raises(ValueError, match="expected a positive number"):
        clip_of(PLAIN, metres_per_unit=unit)


@pytest.mark.parametrize(
    ("written", "rate"),
    [
        ("0.033333", 30.0),
        ("0.008333", 120.0),
        ("0.0416667", 24.0),
        ("0.033367", 30000 / 1001),
        ("2.5", 0.4),
        ("0.0333", 30.0),
        ("0.0125", 80.0),
        ("1e-2", 100.0),
    ],
)
def test_rate_is_the_one_that_a_cut_frame_time_stands_for(written, rate):
    file = bvh.loads(PLAIN.replace("0.0333333", written).encode(), "case.bvh")
    assert file.frame_time == float(written)
    assert file.rate == rate


def test_reads_a_path_and_a_member_of_an_archive(tmp_path):
    path = tmp_path / "walk.bvh"
    path.write_text(PLAIN)
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        archive.writestr("sub/walk.bvh", PLAIN)
    assert bvh.read(path).source == str(path)
    with zipfile.ZipFile(tmp_path / "all.zip") as archive:
        file = bvh.read(zipfile.Path(archive, "sub/walk.bvh"))
    assert file.source.endswith("all.zip/sub/walk.bvh")
    np.testing.assert_array_equal(file.values, ROWS)


def test_wrong_readings_miss_the_tolerance():
    """Negative control: reversed Euler order, an added offset and a shifted column are seen."""
    right = worlds(JOINTS, ROWS)
    reverse = [
        (*joint[:3], joint[3].replace(ZXY, "Yrotation Xrotation Zrotation")) for joint in JOINTS
    ]
    swapped = [[*row[:3], *np.reshape(row[3:], (-1, 3))[:, ::-1].ravel()] for row in ROWS]
    lifted = [("hips", -1, (0, 1e-6, 0), JOINTS[0][3]), *JOINTS[1:]]
    wrong = [
        worlds(reverse, swapped),
        worlds(lifted, ROWS, add_root=True),
        worlds(JOINTS, [[*row[1:], row[0]] for row in ROWS]),
    ]
    for positions in wrong:
        assert np.abs(positions - right).max() > TOLERANCE
