"""Tests of tables: headings, the dialects of CSV, JSON Lines and Parquet, and errors by line."""

import codecs
import json

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rowing import POINT, asked, faults, rows, source, text, write_csv, write_parquet

from posefield.common.errors import FileError, UnknownFormat
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry

HEADING = "stature,hip_height,turn,target_height"
ROW = "1.7,0.9,10,1.0"
OK = json.dumps(POINT)


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.mark.parametrize(
    "content",
    [
        codecs.BOM_UTF8 + f"{HEADING}\n{ROW}\n".encode(),
        f"{HEADING}\r{ROW}".encode(),
        f"\n\n{HEADING}\n\n{ROW}\n\n".encode(),
        b"stature, hip_height , turn , target_height\n1.7, 0.9 , 10, 1e0\n",
        b"target_height,turn,hip_height,stature\n1.0,+10.,.9,17e-1\n",
        b"stature [m],hip_height (m),turn [deg],target_height[ m ]\n1.7,0.9,10,1\n",
    ],
    ids=lambda content: repr(content[:24]),
)
def test_dialects_of_csv_give_the_same_rows(model, tmp_path, content):
    path = tmp_path / "Q.CSV"
    path.write_bytes(content)
    assert asked(rows(model, path)) == [("clip-000000", "usdc", ClipQuestion(controls=POINT))]


@pytest.mark.parametrize(
    "line",
    [
        OK,
        codecs.BOM_UTF8.decode() + OK,
        json.dumps({"controls": POINT}),
        json.dumps({f"controls/{k}": v for k, v in POINT.items()} | {"fps": None}),
    ],
    ids=lambda line: line[:24],
)
def test_dialects_of_json_lines_give_the_same_rows(model, tmp_path, line):
    path = tmp_path / "q.ndjson"
    path.write_text(f"{line}\n")
    assert asked(rows(model, path)) == [("clip-000000", "usdc", ClipQuestion(controls=POINT))]


def test_types_of_parquet_give_the_same_rows(model, tmp_path):
    table = {name: pa.array([value]) for name, value in POINT.items()} | {
        "turn": pa.array([10], pa.int8()),
        "stature": pa.array([1.75], pa.float32()),
        "level": pa.array([2.0]),
        "performer": pa.array(["tall"]).dictionary_encode(),
        "name": pa.array(["a"], pa.large_string()),
        "end": pa.array([None]),
    }
    pq.write_table(pa.table(table), tmp_path / "q.parquet")
    question = ClipQuestion(controls={**POINT, "stature": 1.75}, performer="tall", level=2)
    assert asked(rows(model, tmp_path / "q.parquet")) == [("a", "usdc", question)]


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        (f"{HEADING},turn", "1: column 'turn' twice, expected once"),
        (f"{HEADING},perfomer", "1: unknown column 'perfomer', did you mean 'performer'?"),
        (
            f"{HEADING},zzz",
            "1: unknown column 'zzz', expected one of stature, hip_height, turn, target_height, "
            "format, extrapolate, performer, level, exact, targets, take, variety, detail, fps, "
            "start, end, names, ",
        ),
        (HEADING.replace(",", ";"), "1: unknown column 'stature;hip_height;turn;target_height', "),
        ("", "1: empty, expected a heading"),
    ],
)
def test_a_heading_that_does_not_fit_is_refused(model, tmp_path, heading, said):
    path = text(tmp_path / "q.csv", heading)
    with pytest.raises(FileError) as caught:
        source(model, path)
    assert str(caught.value).startswith(f"{path}:{said}")
    assert str(caught.value).endswith("and commas between columns") == (";" in heading)


@pytest.mark.parametrize("coding", ["utf-16", "latin-1"])
def test_a_heading_in_another_coding_is_refused(model, tmp_path, coding):
    path = tmp_path / "q.csv"
    path.write_bytes(f"stature,höhe\n{ROW}\n".encode(coding))
    with pytest.raises(FileError, match=r"q.csv:1: .* in the heading, expected text in UTF-8"):
        source(model, path)


@pytest.mark.parametrize("cell", ["abc", "1,5", "1_0", "١", "1.7 m", "nan", "1e999", "1.7\udcff"])
def test_a_cell_that_is_no_number_is_named(model, tmp_path, cell):
    path = tmp_path / "q.csv"
    lines = f'{HEADING}\n{ROW}\n0.9,"{cell}",10,1\n{ROW}\n'
    path.write_bytes(lines.encode(errors="surrogateescape"))
    ((place, said),) = faults(model, path)
    assert place == "q.csv:3"
    assert said == f"hip_height: {cell!r}, expected a finite number"


@pytest.mark.parametrize(
    ("more", "line", "said"),
    [
        ("", "1.7,0.9,10", "3 cells, expected 4 as in the heading"),
        (",level", f"{ROW},1.5", "level: '1.5', expected a whole number"),
        (",loop", f"{ROW},1", "loop: '1', expected one of true, false"),
        (",name", f'{ROW},"a"b', "not CSV: ',' expected after '\"'"),
    ],
)
def test_a_row_that_is_no_query_is_named_by_its_line(model, tmp_path, more, line, said):
    ok = ROW + "," * more.count(",")
    path = text(tmp_path / "q.csv", HEADING + more, ok, "", line, ok)
    ((place, message),) = faults(model, path)
    assert place == "q.csv:4"
    assert message.startswith(said)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("{", "not JSON: "),
        ("[1, 2]", "[1, 2], expected an object"),
        ('{"turn": 1, "controls": {"turn": 2}}', "column 'turn' twice, expected once"),
        ('{"turn": NaN}', "controls/turn: nan, expected a finite number"),
        ("[" * 100_000, "objects or lists in one another too often"),
        ('{"name": "\udcff"}', "not JSON: 'utf-8' codec"),
    ],
    ids=lambda text: text[:24],
)
def test_a_line_that_is_no_query_is_named(model, tmp_path, line, said):
    path = tmp_path / "q.jsonl"
    path.write_bytes(f"{OK}\n{line}\n{OK}\n".encode(errors="surrogateescape"))
    ((place, message),) = faults(model, path)
    assert place == "q.jsonl:2"
    assert message.startswith(said)


@pytest.mark.parametrize(("kind", "first"), [("csv", [HEADING, ROW]), ("jsonl", [OK, OK])])
def test_a_line_that_never_ends_is_refused(model, tmp_path, kind, first):
    path = tmp_path / f"q.{kind}"
    path.write_text("\n".join([*first, "1" * (1 << 20)]))
    with pytest.raises(FileError, match=rf"q.{kind}:3: a line of 1048576 characters or more"):
        rows(model, path)


def test_a_file_that_cannot_be_read_is_refused(model, tmp_path):
    (tmp_path / "dir.csv").mkdir()
    for name, said in (("no.csv", "No such file"), ("dir.csv", "not a file")):
        with pytest.raises(FileError, match=said):
            source(model, tmp_path / name)
    with pytest.raises(UnknownFormat) as caught:
        source(model, write_csv(tmp_path / "q.xlsx", [POINT]))
    assert str(caught.value) == "queries: 'q.xlsx' ends in none of .csv, .jsonl, .ndjson, .parquet"


@pytest.mark.parametrize("cut", [0, 20, -20])
def test_a_file_that_is_no_parquet_is_refused(model, tmp_path, cut):
    path = write_parquet(tmp_path / "q.parquet", [POINT])
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(FileError, match=r"q.parquet: cannot be read as Parquet: "):
        source(model, path)
