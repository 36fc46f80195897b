"""Tests of CSV dialects, and of errors with line numbers."""

import codecs
import contextlib

import pytest
from rowing import POINT, asked, faults, rows, source, text, write_csv

from posefield.batch.rows.row_blocks import BLOCK_SIZE
from posefield.batch.rows.row_sources import Defaults
from posefield.common.errors import FileError
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry

HEADING = "stature,hip_height,turn,target_height"
ROW = "1.7,0.9,10,1.0"


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture
def refused(model, tmp_path):
    """Function that expects a table to be refused; gives the message below its name."""

    def of(*lines):
        path = text(tmp_path / "q.csv", *lines)
        with pytest.raises(FileError) as caught:
            source(model, path)
        return str(caught.value).removeprefix(f"{path}:")

    return of


@pytest.fixture
def wrong(model, tmp_path):
    """Function that gives faults of rows below a heading of the controls and more columns."""

    def of(more, *lines):
        return faults(model, text(tmp_path / "q.csv", HEADING + more, *lines))

    return of


def test_a_row_asks_for_a_clip(model, tmp_path):
    (found,) = rows(model, text(tmp_path / "q.csv", HEADING, ROW))
    assert found.question == ClipQuestion(controls=POINT)
    assert (found.name, found.format, found.place) == (
        "clip-000000",
        "usdc",
        f"{tmp_path}/q.csv:2",
    )


def test_a_row_may_say_everything(model, tmp_path):
    path = text(
        tmp_path / "q.csv",
        f"name,format,fps,level,start,end,performer,extrapolate,names,root,loop,{HEADING}",
        f"a.b-C_9,bvh,24,2,0.25,0.5,tall,refuse,vrm,in_place,False,{ROW}",
    )
    question = ClipQuestion(
        controls=POINT,
        fps=24.0,
        extrapolate="refuse",
        start=0.25,
        end=0.5,
        performer="tall",
        level=2,
        names="vrm",
        root="in_place",
        loop=False,
    )
    assert asked(rows(model, path)) == [("a.b-C_9", "bvh", question)]


def test_what_a_row_does_not_say_is_as_usual(model, tmp_path):
    usual = Defaults(
        "bvh",
        ClipQuestion(
            controls={},
            fps=24.0,
            extrapolate="refuse",
            start=0.25,
            end=0.5,
            performer="tall",
            level=2,
        ),
    )
    path = text(tmp_path / "q.csv", f"{HEADING},fps,performer", f"{ROW},,", f"{ROW},60,short")
    first, second = asked(rows(model, path, usual))
    assert first[1:] == (
        "bvh",
        ClipQuestion(
            controls=POINT,
            fps=24.0,
            extrapolate="refuse",
            start=0.25,
            end=0.5,
            performer="tall",
            level=2,
        ),
    )
    assert second[2] == ClipQuestion(
        controls=POINT,
        fps=60.0,
        extrapolate="refuse",
        start=0.25,
        end=0.5,
        performer="short",
        level=2,
    )


@pytest.mark.parametrize(
    "content",
    [
        codecs.BOM_UTF8 + f"{HEADING}\n{ROW}\n".encode(),
        f"{HEADING}\r\n{ROW}\r\n".encode(),
        f"{HEADING}\r{ROW}\r".encode(),
        f"{HEADING}\n{ROW}".encode(),
        f"\n\n{HEADING}\n\n{ROW}\n\n".encode(),
        b'"stature","hip_height","turn","target_height"\n"1.7","0.9","10","1.0"\n',
        b"stature, hip_height , turn , target_height\n1.7, 0.9 , 10, 1e0\n",
        b"target_height,turn,hip_height,stature\n1.0,+10.,.9,17e-1\n",
        b"stature [m],hip_height (m),turn [deg],target_height[ m ]\n1.7,0.9,10,1\n",
        b"controls/stature,hip_height,turn,controls/target_height\n1.7,0.9,10,1\n",
    ],
    ids=lambda content: repr(content[:24]),
)
def test_the_same_table_in_other_words(model, tmp_path, content):
    path = tmp_path / "Q.CSV"
    path.write_bytes(content)
    assert asked(rows(model, path)) == [("clip-000000", "usdc", ClipQuestion(controls=POINT))]


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        (
            "stature,hip_height,turn",
            "1: no column 'target_height', expected one of numbers in m; "
            "found ['stature', 'hip_height', 'turn']",
        ),
        (f"{HEADING},turn", "1: column 'turn' twice, expected once"),
        (f"{HEADING},turn [deg]", "1: column 'turn' twice, expected once"),
        (f"{HEADING},perfomer", "1: unknown column 'perfomer', did you mean 'performer'?"),
        (f"{HEADING},Stature", "1: unknown column 'Stature', did you mean 'stature'?"),
        (
            f"{HEADING},zzz",
            "1: unknown column 'zzz', expected one of stature, hip_height, turn, target_height, "
            "format, extrapolate, performer, level, exact, targets, take, variety, detail, fps, "
            "start, end, names, ",
        ),
        (
            "stature [cm],hip_height,turn,target_height",
            "1: column 'stature' in the unit 'cm', expected m",
        ),
        (
            "stature,hip_height,turn (rad),target_height",
            "1: column 'turn' in the unit 'rad', expected deg",
        ),
        (
            "stature,hip_height,turn (),target_height",
            "1: column 'turn' in the unit '', expected deg",
        ),
        (f"{HEADING},name [m]", "1: column 'name' in the unit 'm', expected none"),
        (f"\n{HEADING},", "2: unknown column '', expected one of stature, "),
        (HEADING.replace(",", ";"), "1: unknown column 'stature;hip_height;turn;target_height', "),
        ('stature,"turn', "1: not CSV: unexpected end of data"),
        ("", "1: empty, expected a heading"),
    ],
)
def test_a_heading_that_does_not_fit_is_refused(refused, heading, said):
    assert refused(*([heading, ROW] if heading and '"' not in heading else [heading])).startswith(
        said
    )


def test_a_heading_of_semicolons_is_told_of_commas(refused):
    assert refused(HEADING.replace(",", ";")).endswith(", and commas between columns")


@pytest.mark.parametrize("coding", ["utf-16", "latin-1"])
def test_a_heading_in_another_coding_is_refused(model, tmp_path, coding):
    path = tmp_path / "q.csv"
    path.write_bytes(f"stature,höhe\n{ROW}\n".encode(coding))
    with pytest.raises(FileError, match=r"q.csv:1: .* in the heading, expected text in UTF-8"):
        source(model, path)


@pytest.mark.parametrize("cell", ["abc", "1,5", "1_0", "١", "--1", "1.7 m", "0x1", "1.7\udcff"])
def test_a_cell_that_is_no_number_is_named(model, tmp_path, cell):
    path = tmp_path / "q.csv"
    lines = f'{HEADING}\n{ROW}\n0.9,"{cell}",10,1\n{ROW}\n'
    path.write_bytes(lines.encode(errors="surrogateescape"))
    said = f"hip_height: {cell!r}, expected a number in m"
    assert faults(model, path) == [("q.csv:3", said)]


@pytest.mark.parametrize(
    ("more", "line", "said"),
    [
        ("", "1.7,,10,1", "hip_height: empty, expected a number in m"),
        ("", "1.7,nan,10,1", "controls/hip_height: nan, expected a finite number"),
        ("", "1.7,-inf,10,1", "controls/hip_height: -inf, expected a finite number"),
        ("", "1.7,1e999,10,1", "controls/hip_height: inf, expected a finite number"),
        ("", "1.7,0.9,1e6,1", "controls/turn: 1000000 deg, expected -14731."),
        ("", "1.7,0.9,10", "3 cells, expected 4 as in the heading"),
        ("", f"{ROW},", "5 cells, expected 4 as in the heading"),
        (",fps", f"{ROW},fast", "fps: 'fast', expected a number in frames a second"),
        (
            ",fps",
            f"{ROW},0.5",
            "fps: 0.5 frames a second, expected 1 to 1000 frames a second",
        ),
        (",level", f"{ROW},1.5", "level: '1.5', expected a whole number"),
        (",level", f"{ROW},4", "level: 4, expected 0 to 3"),
        (",level", f"{ROW},-1", "level: -1, expected 0 to 3"),
        (",performer", f"{ROW},Tall", "performer: 'Tall', expected one of middle, short, tall"),
        (",format", f"{ROW},fbx", "format: 'fbx', expected one of usda, usdc, usdz, "),
        (",extrapolate", f"{ROW},no", "extrapolate: 'no', expected one of ok, warn, refuse"),
        (",start", f"{ROW},-0.1", "start: -0.1 s, expected 0 to 18.5 s"),
        (",end", f"{ROW},19", "end: 19 s, expected 0 to 18.5 s"),
        (",start,end", f"{ROW},0.5,0.4", "start: 0.5 s, expected 0 to 0.4 s"),
        (
            ",extrapolate",
            "1.7,0.9,99,1,refuse",
            "controls: turn = 99 deg lies outside what was sampled, -59.2188 to 87.5 deg",
        ),
        (",names", f"{ROW},mine", "names: 'mine', expected one of own, mixamo, "),
        (",root", f"{ROW},away", "root: 'away', expected one of travelling, in_place"),
        (",loop", f"{ROW},1", "loop: '1', expected true or false"),
        (",loop", f"{ROW},TRUE", "loop: true, expected false: this model's last pose does not"),
        (",name", f'{ROW},"a"b', "not CSV: ',' expected after '\"'"),
    ],
)
def test_a_row_that_is_no_query_is_named(wrong, more, line, said):
    ok = ROW + "," * more.count(",")
    ((place, message),) = wrong(more, ok, "", line, ok)
    assert place == "q.csv:4"
    assert message.startswith(said)


@pytest.mark.parametrize(
    "name",
    ["a/b", "..", ".hidden", "a b", "ä", "a\\b", "a:b", "x" * 101, '"a\nb"', "a\0", "walk "],
)
def test_a_name_that_is_no_file_name_is_named(wrong, name):
    ((place, message),) = wrong(",name", f"{ROW},a", f"{ROW},{name}")
    assert place == "q.csv:3"
    assert message == (
        f"name: {name.strip(chr(34))!r}, expected 1 to 100 of the letters A to Z, digits, '.', '_' "
        "and '-', not '.' first"
    )


@pytest.mark.parametrize("name", ["a", "x" * 100, "-", "_.", "clip-000001.v2"])
def test_a_name_that_can_be_a_file_name_is_taken(model, tmp_path, name):
    (found,) = rows(model, text(tmp_path / "q.csv", f"{HEADING},name", f"{ROW},{name}"))
    assert found.name == name


def test_the_second_of_two_names_is_named(wrong):
    said = "expected a name of its own: an earlier row has it, capitals count for nothing"
    lines = [f"{ROW},{name}" for name in ("walk", "run", "Walk", "", "clip-000003", "run")]
    assert wrong(",name", *lines) == [
        ("q.csv:4", f"name: 'Walk', {said}"),
        ("q.csv:6", f"name: 'clip-000003', {said}"),
        ("q.csv:7", f"name: 'run', {said}"),
    ]


def test_the_name_of_a_row_that_is_no_query_is_free(wrong):
    assert [place for place, _ in wrong(",name", f"x{ROW},walk", f"{ROW},walk")] == ["q.csv:2"]


def test_a_row_of_several_lines_is_named_by_its_first(wrong):
    found = wrong(",name", f'{ROW},"a\nb\nc"', f"{ROW},", "x")
    assert [place for place, _ in found] == ["q.csv:2", "q.csv:6"]


def test_a_quote_that_never_ends_ends_with_the_file(wrong):
    (_, (place, message)) = wrong(",name", f"{ROW},.", f'{ROW},"a', ROW)
    assert (place, message) == ("q.csv:3", "not CSV: unexpected end of data")


def test_rows_that_are_no_queries_move_no_other_name(model, tmp_path):
    path = text(tmp_path / "q.csv", HEADING, ROW, "x", ROW, "x,0.9,10,1", ROW)
    found = [getattr(row, "name", None) for row in rows(model, path)]
    assert found == ["clip-000000", None, "clip-000002", None, "clip-000004"]


def test_many_faults_are_counted_and_the_first_are_kept(model, tmp_path):
    lines = [f"{ROW},{i % 7}" for i in range(10_000)]
    survey = source(model, text(tmp_path / "q.csv", f"{HEADING},level", *lines)).survey()
    assert (survey.total, survey.faulty) == (10_000, sum(i % 7 > 3 for i in range(10_000)))
    lines_at_fault = [i + 2 for i in range(10_000) if i % 7 > 3][:20]
    assert [fault.place for fault in survey.faults] == [
        f"{tmp_path}/q.csv:{line}" for line in lines_at_fault
    ]


def test_a_table_of_no_rows_has_none(model, tmp_path):
    opened = source(model, text(tmp_path / "q.csv", HEADING))
    assert (opened.survey().total, list(opened.rows())) == (0, [])


def test_a_line_that_never_ends_is_refused(model, tmp_path):
    path = tmp_path / "q.csv"
    path.write_text(f"{HEADING}\n{ROW}\n{'1' * (1 << 20)}")
    with pytest.raises(FileError, match=r"q.csv:3: a line of 1048576 characters or more"):
        source(model, path).survey()


def test_a_file_that_changes_while_it_is_read_is_refused(model, tmp_path):
    path = write_csv(tmp_path / "q.csv", [POINT] * 10)
    opened = source(model, path)
    under_way = opened.rows()
    next(under_way)
    write_csv(path, [POINT] * 11)
    with pytest.raises(FileError, match="changed while it was used"):
        list(under_way)
    with pytest.raises(FileError, match="changed while it was used"):
        opened.survey()


@pytest.mark.parametrize("grown", [0, 1])
def test_no_row_is_given_of_a_file_that_has_changed(grown, model, tmp_path):
    """Check a block read before the change; the next export would keep its clips."""
    path = write_csv(tmp_path / "q.csv", [POINT] * 3 * BLOCK_SIZE)
    under_way = source(model, path).rows()
    next(under_way)
    with path.open("ab") as file:
        file.write(b"\n" * grown)
    given = [None]
    with contextlib.suppress(FileError):
        given.extend(under_way)
    assert len(given) == (BLOCK_SIZE if grown else 3 * BLOCK_SIZE)


def test_a_file_that_does_not_change_may_be_read_again(model, tmp_path):
    """Negative control of the test above."""
    opened = source(model, write_csv(tmp_path / "q.csv", [POINT] * 10))
    assert list(opened.rows()) == list(opened.rows())
