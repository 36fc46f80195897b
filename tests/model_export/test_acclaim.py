"""Tests of the Acclaim reader: a small arm by hand, other files, and the clips of HDM05."""

import re

import numpy as np
import pytest
from acclaim_files import ARM_AMC, ARM_ASF, files_of
from scipy.spatial.transform import Rotation

from posefield.common.errors import AcclaimError
from posefield_train.source import acclaim, bvh, data_folder

UNIT, RATE = 0.056444, 120.0
# The given BVH files are written to four decimals of the unit: 5.3e-6 m was measured.
WRITTEN = 1e-5


def load(folder, asf=ARM_ASF, amc=ARM_AMC, unit=1.0):
    """The clip of two texts."""
    (folder / "a.asf").write_bytes(asf.encode("latin-1"))
    (folder / "a.amc").write_bytes(amc.encode("latin-1"))
    skeleton = acclaim.read_asf(folder / "a.asf")
    motion = acclaim.read_amc(folder / "a.amc", skeleton)
    return acclaim.to_clip(skeleton, motion, metres_per_unit=unit, rate=RATE)


def ends(clip):
    """Places (F, 3) of the end of the bone `upper`, where `lower` begins."""
    return clip.positions()[:, clip.skeleton.names.index("lower")]


def test_an_arm_moves_as_worked_out_by_hand(tmp_path):
    clip = load(tmp_path, unit=0.5)
    assert clip.skeleton.names == ("root", "upper", "lower")
    assert clip.skeleton.parents == (-1, 0, 1)
    assert clip.rate == RATE and len(clip) == 2
    assert np.allclose(clip.skeleton.offsets, [[0, 0, 0], [0, 0, 0], [1.0, 0, 0]])
    assert np.allclose(clip.skeleton.tip_offsets, [[1.5, 0, 0]])
    # The bone's own x axis is the world's y axis: 90 degrees about it turn x to -z. Then 90 degrees
    # about z, for both the same, turn x to y, which the root's turn about y leaves.
    lower = ends(clip) - 0.5 * np.array([1.0, 2.0, 3.0])
    assert np.allclose(lower, [[0, 0, -1.0], [0, 1.0, 0]], atol=1e-12)


def test_the_axis_of_a_bone_matters(tmp_path):
    """Negative control: with axes as the world's the first turn leaves the bone where it is."""
    clip = load(tmp_path, asf=ARM_ASF.replace("axis 0 0 90", "axis 0 0 0"), unit=0.5)
    assert np.allclose(ends(clip)[0], 0.5 * np.array([3.0, 2.0, 3.0]))


@pytest.mark.parametrize("order", ["XYZ", "ZYX", "YZX"])
def test_angles_turn_about_fixed_axes_in_the_stated_order(tmp_path, order):
    """Oracle: scipy. The first axis of the order turns first."""
    turned = ARM_AMC.replace("root 1 2 3 0 90 0\nupper 0 90", "root 1 2 3 30 40 50\nupper 0 0")
    clip = load(tmp_path, asf=ARM_ASF.replace("axis XYZ", f"axis {order}"), amc=turned)
    degrees = dict(zip("XYZ", (30.0, 40.0, 50.0), strict=True))
    rotation = Rotation.from_euler(order.lower(), [degrees[axis] for axis in order], degrees=True)
    expected = np.array([1.0, 2.0, 3.0]) + rotation.apply([2.0, 0.0, 0.0])
    assert np.allclose(ends(clip)[1], expected, atol=1e-12)


def test_line_ends_and_blanks_do_not_matter(tmp_path):
    expected = load(tmp_path).positions()
    texts = (re.sub("\n", " \r\n", text) for text in (ARM_ASF, ARM_AMC))
    assert np.array_equal(load(tmp_path, *texts).positions(), expected)


def asf(old, new):
    return {"asf": ARM_ASF.replace(old, new, 1)}


def amc(old, new):
    return {"amc": ARM_AMC.replace(old, new, 1)}


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (asf("angle deg", "angle gon"), r"asf:7: found 'angle gon', expected angle deg or angle"),
        (asf("RX RY RZ", "RX RY"), r"asf:11: .*expected order and TX TY TZ RX RY RZ, each once"),
        (asf("dof rx rz", "dof rx tz"), r"asf:22: .*some of rx, ry and rz, each once"),
        (asf("90 XYZ", "90 ZYX"), r"asf:21: .*in the order XYZ, or zeros in any"),
        (asf("orientation 0", "orientation 9"), r"asf:14: .*expected orientation 0 0 0"),
        (asf("direction 1 0 0", "direction 1 0"), r"asf:19: .*expected direction and 3 words"),
        (asf("length 2", "length 2e99"), r"asf:20: .*numbers of at most 1e\+09"),
        (asf("name upper", "name lower"), r"asf:32: found bone 'lower' twice"),
        (asf("upper lower", ""), r"asf:37: found no way from the root to lower, expected one"),
        (asf(ARM_ASF[ARM_ASF.index(":hier") :], ""), r"asf: found no entry of section :hierarchy"),
        (amc(":DEGREES", "DEGREES"), r"amc:3: found 'DEGREES', expected a header"),
        (amc("\n2\n", "\n3\n"), r"amc:7: found '3', expected frame 2"),
        (amc("upper 90 0", "upper 90"), r"amc:6: found 'upper 90', expected upper and 2 numbers"),
        (amc("\n1\n", "\n" + "#" * 10_000 + "\n1\n"), r"amc:4: found more bytes than allowed"),
        (amc(ARM_AMC[ARM_AMC.index("\n1\n") :], "\n"), r"amc: found no frame, expected at least"),
    ],
)
def test_what_would_change_the_motion_is_refused(tmp_path, texts, said):
    with pytest.raises(AcclaimError, match=said):
        load(tmp_path, **texts)


@pytest.mark.parametrize(
    "texts",
    [
        asf(":units", ":namespace mo\n:units"),
        {
            "asf": ARM_ASF.replace("angle deg", "angle rad").replace(
                "0 0 90 X", "0 0 1.5707963268 X"
            )
        },
        asf("TX TY TZ RX RY RZ", "RY TX TY TZ RZ RX")
        | {
            "amc": ARM_AMC.replace("1 2 3 0 0 0", "0 1 2 3 0 0").replace(
                "1 2 3 0 90 0", "90 1 2 3 0 0"
            )
        },
        asf("dof rx rz", "dof rz rx")
        | {"amc": ARM_AMC.replace("90 0\n2", "0 90\n2").removesuffix("0 90\n") + "90 0\n"},
        asf("axis XYZ", "axis ZYX"),
        asf("axis 0 0 0 XYZ", "axis 0 0 0 ZYX"),
        asf("position 0 0 0", "position 1 0 0"),
        amc(":FULLY-SPECIFIED\n", ""),
        amc(":DEGREES", ":DEGREES\n:SAMPLES-PER-SECOND 120"),
    ],
)
def test_other_words_for_the_same_motion_are_read(tmp_path, texts):
    expected = load(tmp_path).positions()
    assert load(tmp_path, **texts).positions() == pytest.approx(expected, abs=1e-9)


def test_a_file_that_is_missing_is_named(tmp_path):
    with pytest.raises(AcclaimError, match=r"none\.asf: cannot be read: No such file"):
        acclaim.read_asf(tmp_path / "none.asf")


@pytest.fixture(scope="module")
def reaches(real_data):
    """Function from a folder and a name in the data of HDM05 to its place."""
    return lambda name: data_folder.find(real_data, f"hdm05_reach/{name}")


@pytest.mark.parametrize("name", ["bd_depositFloorR_001", "tr_grabHighR_029"])
def test_clips_are_those_of_the_given_bvh_files(reaches, name):
    skeleton = acclaim.read_asf(reaches(f"asf_amc/HDM_{name[:2]}.asf"))
    motion = acclaim.read_amc(reaches(f"asf_amc/HDM_{name}_120.amc"), skeleton)
    clip = acclaim.to_clip(skeleton, motion, metres_per_unit=UNIT, rate=RATE)
    given = bvh.to_clip(
        bvh.read(reaches(f"bvh/HDM_{name}_120.bvh")),
        metres_per_unit=UNIT,
        up="y",
        root_offset="replace",
    )
    assert clip.skeleton.same_tree(given.skeleton)
    assert (len(clip), clip.rate) == (len(given), given.rate)
    apart = clip.positions() - given.positions()
    assert np.abs(apart).max() < WRITTEN
    assert np.abs(clip.skeleton.tip_offsets - given.skeleton.tip_offsets).max() < WRITTEN
    shifted = clip.positions()[1:] - given.positions()[:-1]
    assert np.abs(shifted).max() > 100 * WRITTEN, "negative control: a frame later"


def test_files_of_a_clip_are_read_back(reaches, tmp_path):
    file = bvh.read(reaches("bvh/HDM_bd_grabHighR_001_120.bvh"))
    clip = bvh.to_clip(file, metres_per_unit=UNIT, up="y", root_offset="replace")
    again = load(tmp_path, *files_of(clip, UNIT), unit=UNIT)
    assert again.skeleton.same_tree(clip.skeleton)
    assert np.abs(again.positions() - clip.positions()).max() < 1e-7
