"""Tests of invalid BVH files: each error gives found and expected values and the line."""

import io
import tracemalloc

import numpy as np
import pytest

from posefield.common.errors import BvhError
from posefield_train.source import bvh
from posefield_train.source.bvh import MAX_LINE

VALID = """\
HIERARCHY
ROOT hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 5 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
1 2 3 4 5 6 7 8 9
1 2 3 4 5 6 7 8 9
1 2 3 4 5 6 7 8 9
"""
ROW = "1 2 3 4 5 6 7 8 9\n"


def refused(content):
    content = content if isinstance(content, bytes) else content.encode()
    with pytest.raises(BvhError) as caught:
        bvh.loads(content, "clips/walk.bvh")
    assert caught.value.path == "clips/walk.bvh"
    assert str(caught.value) == f"clips/walk.bvh:{caught.value.line}: {caught.value.message}"
    return caught.value


def changed(old, new, count=1):
    assert old in VALID
    return VALID.replace(old, new, count)


def line_changed(number, new):
    """The valid file with another text in one line."""
    lines = VALID.split("\n")
    lines[number - 1] = new
    return "\n".join(lines)


JOINT_PLACES = "expected OFFSET, CHANNELS, JOINT, End Site or '}' in joint"
OWN_LINES = "expected 9 a frame, on lines of its own"

HIERARCHY_FAULTS = [
    ("; FBX 7.3\n", 1, "found ';', expected HIERARCHY"),
    (line_changed(2, "JOINT hips"), 2, "found 'JOINT', expected ROOT"),
    (line_changed(2, "ROOT"), 2, "found no name, expected a joint's name on this line"),
    (line_changed(9, "SCALE 1"), 9, f"found 'SCALE', {JOINT_PLACES} 'spine' of line 6"),
    (
        line_changed(9, "End Site { OFFSET 0 0 0 }\nCHANNELS 1 Xrotation"),
        10,
        "found CHANNELS of joint 'spine' after a child, expected it before",
    ),
    (line_changed(8, "OFFSET 1e999 10 0"), 8, "found '1e999', expected an OFFSET of at most 1e+09"),
    (line_changed(12, "OFFSET 0 5 0\nCHANNELS 1 Xrotation"), 13, "found 'CHANNELS', expected }"),
    (
        changed("3 Zrotation Xrotation", "3 Zrotation Wrotation"),
        9,
        "found 'Wrotation', expected a channel, one of "
        "Xposition, Yposition, Zposition, Xrotation, Yrotation, Zrotation",
    ),
    (changed("CHANNELS 3", "CHANNELS 2"), 9, "found 3 channel names, expected CHANNELS 2"),
    (
        changed("JOINT spine", "JOINT hips"),
        6,
        "joint name 'hips' stands at line 2 and again at line 6, "
        "expected every joint to have its own name",
    ),
    (line_changed(15, ""), 16, f"found MOTION, {JOINT_PLACES} 'hips' of line 2"),
    (
        VALID[: VALID.index("    End Site")],
        10,
        f"found the end of the file, {JOINT_PLACES} 'spine' of line 6",
    ),
    (
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 999999999999\nFrame Time: 1\n",
        6,
        "found no channel in 1 joints, expected at least one",
    ),
]

FRAME_TIME = "expected a positive number of seconds from 1e-06 to 1e+06"

MOTION_FAULTS = [
    (line_changed(17, "Frames: 0"), 17, "found 0 frames, expected at least 1"),
    (line_changed(18, ""), 19, f"found '{ROW.strip()}', expected 'Frame Time: seconds'"),
    (line_changed(18, "Frame Time: 1e-320"), 18, f"found frame time 1e-320, {FRAME_TIME}"),
    (changed("Frames: 3", "Frames: 5"), 21, "found 3 frames, expected 5"),
    (
        "\n".join([*VALID.split("\n")[:18], "1 2 3 4 5 6 7 8", ROW + "1 2 3 4 5 6 7 8 9 10", ""]),
        19,
        f"found 8 and then 9 numbers, {OWN_LINES}",
    ),
    (line_changed(20, "1 2 3 nan 5 6 7 8 9"), 20, "found 'nan', expected a number"),
    (line_changed(20, "1 2 3 4 -1e300 6 7 8 9"), 20, "found '-1e300', expected at most 1e+09"),
    (line_changed(20, "1 2 3 4 5 6 7 8 9_0"), 20, "found '9_0', expected a number"),
    (VALID + "\nNotes by hand\n", 23, "found 'Notes' after the last frame, expected nothing"),
]

FAULTS = HIERARCHY_FAULTS + MOTION_FAULTS


@pytest.mark.parametrize(("content", "line", "message"), FAULTS)
def test_fault_is_named_with_its_line(content, line, message):
    error = refused(content)
    assert (error.line, error.message) == (line, message)


def nested(levels):
    head = "".join(
        f"{'JOINT' if level else 'ROOT'} j{level}\n{{\nOFFSET 0 1 0\nCHANNELS 1 Xrotation\n"
        for level in range(levels)
    )
    values = " ".join(["0"] * levels)
    motion = f"MOTION\nFrames: 1\nFrame Time: 0.1\n{values}\n"
    return f"HIERARCHY\n{head}{'}' * levels}\n{motion}"


def flat(joints):
    many = "".join(f"JOINT j{index} {{ OFFSET 0 0 0 }}\n" for index in range(1, joints))
    head = f"HIERARCHY\nROOT j0 {{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n{many}}}\n"
    return head + "MOTION\nFrames: 1\nFrame Time: 0.1\n0\n"


def test_depth_is_bounded():
    assert len(bvh.loads(nested(256).encode(), "deep.bvh").joints) == 256
    error = refused(nested(257))
    assert error.message == "found 257 levels, expected at most 256"
    assert error.line == 2 + 256 * 4
    assert refused(nested(100_000)).line == error.line


def test_number_of_joints_is_bounded():
    assert len(bvh.loads(flat(1000).encode(), "wide.bvh").joints) == 1000
    error = refused(flat(1001))
    assert (error.line, error.message) == (1002, "found 1001 joints, expected at most 1000")


def test_a_huge_declared_count_allocates_nothing():
    tracemalloc.start()
    try:
        error = refused(changed("Frames: 3", "Frames: 999999999999999999"))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert error.message == "found 3 frames, expected 999999999999999999"
    assert peak < 1_000_000


def test_joints_that_cost_the_file_nothing_are_bounded():
    frames = 10_001
    text = flat(1000).replace("Frames: 1\n", f"Frames: {frames}\n") + "0\n" * (frames - 1)
    error = refused(text)
    assert error.message == (
        "found 10001 frames of 1000 joints, expected at most 10000000 poses of a joint"
    )


def test_a_long_word_is_refused_in_linear_time_and_cut_in_the_message():
    digits = "1." + "1" * 200_000 + "x"
    error = refused(line_changed(20, digits))
    assert (error.line, len(error.message)) == (20, len("found '', expected a number") + 40)
    assert refused(line_changed(8, f"OFFSET 0 0 {digits}")).line == 8
    assert refused(line_changed(18, f"Frame Time: {digits}")).line == 18


@pytest.mark.parametrize(("line", "blank"), [(12, "\r\n"), (17, "\n"), (19, " \n")])
def test_blank_lines_take_no_memory(line, blank):
    lines = VALID.split("\n")
    count = 1_000_000
    content = "\n".join(lines[: line - 1]) + "\n" + blank * count + "\n".join(lines[line - 1 :])
    tracemalloc.start()
    try:
        found = bvh.loads(content.encode(), "clips/walk.bvh")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert np.array_equal(found.values, bvh.loads(VALID.encode(), "clips/walk.bvh").values)
    # A list of the words of each line alone would take 64 MB.
    assert peak < 25_000_000
    # Lines are counted all the same.
    wrong = content.rstrip("\n") + " x\n"
    assert refused(wrong).line == len(lines) - 1 + count


def test_a_line_is_bounded():
    error = refused(line_changed(20, " " * MAX_LINE))
    assert (error.line, error.message) == (20, "found 256000 characters in a line, expected fewer")


def test_the_text_before_the_motion_is_bounded():
    error = refused(changed("HIERARCHY", "HIERARCHY" + " \n" * 2_000_000))
    assert error.message == "found 4 MB without a line MOTION, expected ROOT"


class Endless(io.BufferedIOBase):
    """A file that begins like another and goes on with the same for ever."""

    def __init__(self, start, rest):
        self.start, self.rest = io.BytesIO(start.encode()), rest
        self.given = 0

    def readable(self):
        return True

    def read1(self, size):
        piece = self.start.read(size) or self.rest[:size]
        self.given += len(piece)
        return piece


def test_the_size_of_a_file_is_bounded():
    file = Endless(VALID, (b" " * 4000 + b"\n") * 3)
    with pytest.raises(BvhError) as caught:
        bvh.load(file, "clips/walk.bvh")
    assert caught.value.message == "found more than 1000 MB, expected at most 1000 MB"
    assert file.given < 1_010_000_000


ALIKE = "".join(f"{row} 2 3 4 5 6 7 8 9\n" for row in range(200_000))
"""Lines of numbers that fill several blocks."""


def long_motion(text, frames=200_000):
    return VALID.replace(3 * ROW, text).replace("Frames: 3", f"Frames: {frames}")


def test_frames_are_read_over_lines():
    values = bvh.loads(long_motion(ALIKE).encode(), "clips/walk.bvh").values
    assert values.shape == (200_000, 9)
    assert np.array_equal(values[:, 0], np.arange(200_000.0))
    assert np.array_equal(values[:, 1:], np.tile(np.arange(2.0, 10.0), (200_000, 1)))
    # The same frames over lines of which none is a frame.
    apart = long_motion(ALIKE.replace(" 5", "\n5"))
    assert np.array_equal(bvh.loads(apart.encode(), "clips/walk.bvh").values, values)


def test_far_too_many_numbers_are_not_counted_to_the_end():
    # A thousand joints leave 10,000 frames of one channel.
    file = Endless(flat(1000), b"0\n" * MAX_LINE)
    with pytest.raises(BvhError) as caught:
        bvh.load(file, "clips/walk.bvh")
    assert caught.value.message == "found more than 2 frames, expected 1"
    assert file.given < 1_000_000


@pytest.mark.parametrize("row", [60_000, 199_999])
def test_faults_are_found_in_every_block(row):
    line = f"\n{row} 2 3 4 5 6 7 8 9\n"
    whole = "\n" + ALIKE
    assert whole.count(line) == 1

    def fault(new):
        error = refused(long_motion(whole.replace(line, new)[1:]))
        return error.line - 19, error.message

    assert fault("\n1 2 3 4 x 6 7 8 9\n") == (row, "found 'x', expected a number")
    short = "found 5 and then 9 numbers" if row < 199_999 else "found 5 numbers"
    assert fault("\n1 2 3 4 5\n") == (row, f"{short}, {OWN_LINES}")
    swapped = whole.replace("\n5 2 3 4 5 6 7 8 9\n", "\n5 2 3 4 5 6 7 8\n")
    swapped = swapped.replace("\n190000 2", "\n0 190000 2")
    error = refused(long_motion(swapped[1:]))
    assert (error.line, error.message) == (19 + 5, f"found 8 and then 9 numbers, {OWN_LINES}")


@pytest.mark.parametrize("content", [b"\0" * 100_000, VALID.encode("utf-16")])
def test_binary_formats_are_refused_at_the_first_line(content):
    error = refused(content)
    assert error.line == 1
    assert "expected HIERARCHY" in error.message
    assert len(error.message) < 200


@pytest.mark.parametrize("name", ["none.bvh", "."])
def test_what_cannot_be_read_is_named(tmp_path, name):
    with pytest.raises(BvhError, match="cannot be read: ") as caught:
        bvh.read(tmp_path / name)
    assert caught.value.path == str(tmp_path / name)
    # Negative control: what is there is read.
    (tmp_path / "valid.bvh").write_text(VALID)
    assert bvh.read(tmp_path / "valid.bvh").values.shape == (3, 9)
