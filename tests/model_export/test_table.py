"""Tests of the table of clips: valid cells, and errors with line and column."""

import codecs

import pytest
from minimal import recipe_with

from posefield.common.errors import RecipeError
from posefield_train.source import clip_table

FRAMES = {"first_frame": "from", "last_frame": "to"}


@pytest.fixture
def rows(tmp_path):
    """Function that reads a table of a text; a.bvh, b.bvh and c.bvh exist."""
    for name in "abc":
        (tmp_path / f"{name}.bvh").touch()

    def of(text, **clips):
        content = text if isinstance(text, bytes) else text.encode()
        (tmp_path / "clips.csv").write_bytes(content)
        return clip_table.read(recipe_with(clips=clips), tmp_path)

    return of


@pytest.fixture
def refused(rows):
    """Function that expects a table to be refused and gives the error."""

    def of(text, **clips):
        with pytest.raises(RecipeError) as caught:
            rows(text, **clips)
        return caught.value

    return of


def test_a_row_says_file_controls_and_frames(rows, tmp_path):
    found = rows(
        "file,who,v,from,to,hit\na.bvh,ann,1.5,2,9,4\nb.bvh,bob,-2e1,0,5,3\n",
        performer="who",
        landmarks=["hit"],
        **FRAMES,
    )
    assert [row.file for row in found] == [tmp_path / "a.bvh", tmp_path / "b.bvh"]
    assert [row.performer for row in found] == ["ann", "bob"]
    assert [row.controls.tolist() for row in found] == [[1.5], [-20.0]]
    assert [(row.first_frame, row.last_frame) for row in found] == [(2, 9), (0, 5)]
    assert [row.landmarks for row in found] == [(4,), (3,)]
    assert [row.line for row in found] == [2, 3]


def test_motion_files_stand_beside_the_table(tmp_path):
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "a.bvh").touch()
    (tmp_path / "set" / "clips.csv").write_text("file,v\na.bvh,1\n")
    (row,) = clip_table.read(recipe_with(clips={"table": "set/clips.csv"}), tmp_path)
    assert row.file == tmp_path / "set" / "a.bvh"


@pytest.mark.parametrize(
    ("clips", "column", "why"),
    [
        ({"performer": "who"}, "who", "clips.performer"),
        ({"landmarks": ["hit"]}, "hit", "clips.landmarks"),
        ({"where": {"kind": {"among": ["x"]}}}, "kind", "clips.where"),
    ],
)
def test_a_missing_column_is_named_with_the_columns_that_are_there(refused, clips, column, why):
    fault = refused("file,v,turn\na.bvh,1,2\n", **clips)
    assert fault.line == 1
    assert fault.message == f"no column {column!r} ({why}); there are file, v, turn"


@pytest.mark.parametrize("cell", ["", "1,5", "1e999"])
def test_a_cell_that_is_no_finite_number_is_named_by_line_and_column(refused, tmp_path, cell):
    fault = refused(f'file,v\na.bvh,1\nb.bvh,"{cell}"\n')
    assert str(fault).startswith(f"{tmp_path / 'clips.csv'}:3: ")
    assert fault.message.startswith(f"column 'v': {cell!r}, expected a number")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("file,v\nb.bvh,1\na.bvh,1,2\n", "found 3 cells, expected the 2 of the heading"),
        ('file,v\na.bvh,"1\n', "not CSV: unexpected end of data"),
        ("", "no rows below the heading"),
        ("file,v\nü.bvh,1\n".encode("latin-1"), "not UTF-8 text"),
    ],
)
def test_what_is_no_table_is_refused(refused, text, said):
    assert refused(text).message.startswith(said)


def test_quoted_line_breaks_belong_to_their_cell_and_count_as_lines(rows, refused):
    text = 'file,v,note\na.bvh,1,"two\nlines"\nb.bvh,2,none\n'
    assert [row.controls.tolist() for row in rows(text)] == [[1.0], [2.0]]
    assert refused(text.replace("b.bvh,2", "b.bvh,x")).line == 4
    assert refused("file,v\nb.bvh,1\na.bvh,1,2\n").line == 3


def test_a_byte_order_mark_is_no_part_of_the_first_column(rows):
    (row,) = rows(codecs.BOM_UTF8 + b"file,v\r\na.bvh,1\r\n")
    assert row.controls.tolist() == [1.0]
    assert (row.first_frame, row.last_frame, row.performer) == (0, None, "")


THREE = "file,v,who,turn\na.bvh,1,ann,-5\nb.bvh,2,bob,0\nc.bvh,3,ann,7.5\n"


@pytest.mark.parametrize(
    ("where", "left"),
    [
        ({"who": {"among": ["ann"]}}, [1, 3]),
        ({"who": {"without": ["ann"]}}, [2]),
        ({"turn": {"minimum": -5.0, "maximum": 5.0}}, [1, 2]),
        ({"who": {"among": ["ann"]}, "turn": {"maximum": 0.0}}, [1]),
    ],
)
def test_conditions_choose_rows_and_their_bounds_count_in(rows, where, left):
    assert [row.controls[0] for row in rows(THREE, where=where)] == left


def test_rows_that_do_not_belong_may_hold_anything(rows, refused):
    text = THREE.replace("b.bvh,2", "missing.bvh,?")
    assert len(rows(text, where={"who": {"among": ["ann"]}})) == 2
    fault = refused(THREE, where={"who": {"among": ["eve"]}})
    assert fault.message == "none of 3 rows meets the conditions"


def test_a_clip_has_two_frames_at_least_of_whole_numbers(rows, refused):
    fault = refused("file,v,from,to\na.bvh,1,3,3\n", **FRAMES)
    assert (fault.line, fault.message) == (2, "frames 3 to 3, expected at least two")
    for cell in ("1.5", "-1"):
        fault = refused(f"file,v,from,to\na.bvh,1,{cell},9\n", **FRAMES)
        assert (fault.line, fault.message) == (
            2,
            f"column 'from': '{cell}', expected a frame from 0",
        )
    assert rows("file,v,from,to\na.bvh,1,3,4\n", **FRAMES)


def test_a_motion_file_that_is_missing_is_named_by_row_and_column(refused, tmp_path):
    fault = refused("file,v\na.bvh,1\nd.bvh,2\n")
    assert fault.line == 3
    assert fault.message.startswith("column 'file': no file 'd.bvh'; tried ")
    assert str(tmp_path / "d.bvh") in fault.message


def test_a_motion_file_outside_the_folder_is_refused_by_row(refused):
    fault = refused("file,v\n../a.bvh,1\n")
    assert (fault.line, fault.path.rpartition("/")[2]) == (2, "clips.csv")
    assert "expected a path below the data folder" in fault.message


def test_the_same_clip_twice_is_refused_with_both_lines(rows, refused):
    fault = refused("file,v\na.bvh,1\nb.bvh,2\na.bvh,3\n")
    assert (fault.line, fault.message) == (4, "the same frames of the same file as line 2")
    other_frames = "file,v,from,to\na.bvh,1,0,5\na.bvh,2,1,5\n"
    assert len(rows(other_frames, **FRAMES)) == 2


def test_the_number_of_rows_is_bounded(rows, refused):
    row = "a.bvh,1\n"
    fault = refused("file,v\n" + row * 1_000_000)
    message = "found more than 100000 rows, expected at most 100000"
    assert (fault.line, fault.message) == (100_002, message)
    among = {"v": {"among": ["2"]}}
    text = "file,v\n" + row * 99_999 + "b.bvh,2\n"
    assert len(rows(text, where=among)) == 1


def test_the_number_of_columns_is_bounded(refused):
    names = ",".join(f"c{index}" for index in range(100_000))
    fault = refused(f"{names}\n")
    message = "found 100000 columns, expected at most 1000"
    assert (fault.line, fault.message) == (1, message)


def test_the_size_of_a_table_is_bounded(refused):
    fault = refused("file,v\n" + " " * clip_table.MAX_BYTES)
    assert fault.message == "found more than 16000 kB, expected a table of at most 16000 kB"


def test_a_missing_table_is_refused(tmp_path):
    with pytest.raises(RecipeError, match=r"no file 'clips\.csv'"):
        clip_table.read(recipe_with(), tmp_path)
