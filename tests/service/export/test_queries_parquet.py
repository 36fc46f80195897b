"""Tests of Parquet: column types, and the error without pyarrow."""

import subprocess
import sys

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rowing import POINT, asked, faults, rows, source, write_parquet

from posefield.common.errors import FileError
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry

HIDDEN = """
import sys
sys.modules["pyarrow"] = None
from pathlib import Path
from posefield.batch.rows import row_sources as queries
from posefield.common.errors import FileError
from posefield.registry import model_registry as library
model = library.load([Path(sys.argv[1])]).models["labelled"]
try:
    queries.open_source(queries.SourceOptions(Path(sys.argv[2])), queries.Defaults("usdc"), model)
except FileError as fault:
    print(fault)
"""


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture
def table(tmp_path):
    """Function that writes a row of controls with columns replaced or added."""

    def of(**columns):
        made = {name: pa.array([value]) for name, value in POINT.items()}
        pq.write_table(pa.table({**made, **columns}), tmp_path / "q.parquet")
        return tmp_path / "q.parquet"

    return of


def test_a_row_asks_for_a_clip(model, table):
    path = table(
        turn=pa.array([10], pa.int8()),
        stature=pa.array([1.75], pa.float32()),
        level=pa.array([2.0]),
        performer=pa.array(["tall"]).dictionary_encode(),
        name=pa.array(["a"], pa.large_string()),
        end=pa.array([None]),
        fps=pa.array([None], pa.float64()),
    )
    question = ClipQuestion(controls={**POINT, "stature": 1.75}, performer="tall", level=2)
    opened = source(model, path)
    assert asked(opened.rows()) == [("a", "usdc", question)]
    assert opened.survey().total == 1


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"turn": pa.array(["10"])}, "column 'turn' of type string, expected a number in deg"),
        ({"turn": pa.array([True])}, "column 'turn' of type bool, expected a number in deg"),
        ({"name": pa.array([7])}, "column 'name' of type int64, expected 1 to 100 of"),
        ({"fpss": pa.array([7])}, "unknown column 'fpss', did you mean 'fps'?"),
        ({"stature [cm]": pa.array([7.0])}, "column 'stature' in the unit 'cm', expected m"),
        ({"stature [m]": pa.array([7.0])}, "column 'stature' twice, expected once"),
        ({"controls": pa.array([POINT])}, "unknown column 'controls', "),
    ],
)
def test_columns_that_do_not_fit_are_refused(model, table, columns, said):
    path = table(**columns)
    with pytest.raises(FileError) as caught:
        source(model, path)
    assert str(caught.value).startswith(f"{path}: {said}")


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"turn": pa.array([None], pa.float64())}, "turn: empty, expected a number in deg"),
        ({"turn": pa.array([float("nan")])}, "controls/turn: nan, expected a finite number"),
        ({"level": pa.array([0.5])}, "level: 0.5, expected a whole number"),
        ({"name": pa.array([""])}, "name: empty, expected 1 to 100 of"),
    ],
)
def test_a_row_that_is_no_query_is_named(model, table, columns, said):
    ((place, message),) = faults(model, table(**columns))
    assert place == "q.parquet row 1"
    assert message.startswith(said)


def test_row_groups_leave_no_seam(model, tmp_path):
    table = pa.table(
        {**{k: [v] * 1000 for k, v in POINT.items()}, "fps": [float(i + 1) for i in range(1000)]}
    )
    pq.write_table(table, tmp_path / "q.parquet", row_group_size=7)
    found = rows(model, tmp_path / "q.parquet")
    assert [row.question.fps for row in found] == [float(i + 1) for i in range(1000)]
    assert [row.name for row in found] == [f"clip-{i:06d}" for i in range(1000)]


@pytest.mark.parametrize("cut", [0, 20, -20])
def test_a_file_that_is_no_parquet_is_refused(model, tmp_path, cut):
    path = write_parquet(tmp_path / "q.parquet", [POINT])
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(FileError, match=r"q.parquet: cannot be read as Parquet: "):
        source(model, path)


def test_a_page_that_is_broken_is_refused_when_it_is_read(model, tmp_path):
    path = write_parquet(tmp_path / "q.parquet", [POINT] * 1000)
    content = bytearray(path.read_bytes())
    content[4:60] = bytes(56)
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"q.parquet: cannot be read as Parquet: "):
        source(model, path).survey()


def test_without_pyarrow_the_extra_is_named(labelled_path, tmp_path):
    path = write_parquet(tmp_path / "q.parquet", [POINT])
    done = subprocess.run(
        [sys.executable, "-c", HIDDEN, labelled_path, path],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == f'{path}: needs pyarrow to be read: pip install "posefield[parquet]"\n'
