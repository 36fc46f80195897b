"""Tests of floors in query rows: text, numbers and objects."""

import re

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rowing import faults, rows, text, write_jsonl

from posefield.question.floor import Floor
from posefield.registry import model_registry

PLANE = Floor(0.1, 0.0, -0.2)


@pytest.fixture(scope="module")
def walk(walk_path):
    return model_registry.load([walk_path]).models["stroll"]


def middle(model):
    return {control.name: control.default for control in model.session.card.controls}


def floors(model, path):
    return [each.question.floor for each in rows(model, path)]


def test_floors_of_tables_are_text(walk, tmp_path):
    controls = middle(walk)
    values = ",".join(map(str, controls.values()))
    path = text(
        tmp_path / "q.csv",
        ",".join([*controls, "floor"]),
        f"{values},0.2",
        f'{values},"0.1,0,-0.2"',
        f"{values},",
    )
    assert floors(walk, path) == [0.2, PLANE, 0.0]


def test_floors_of_lines_are_numbers_text_or_objects(walk, tmp_path):
    plane = {"height": 0.1, "slope_x": 0, "slope_z": -0.2}
    given = [0.2, plane, "0.1,0,-0.2", None]
    lines = [middle(walk) | {"floor": floor} for floor in given]
    assert floors(walk, write_jsonl(tmp_path / "q.jsonl", lines)) == [0.2, PLANE, PLANE, 0.0]


@pytest.mark.parametrize(
    ("given", "kind", "expected"),
    [
        ([0.2, None], pa.float32(), [pytest.approx(0.2), 0.0]),
        ([1, 2], pa.int32(), [1.0, 2.0]),
        (["0.2", "0.1,0,-0.2"], pa.string(), [0.2, PLANE]),
    ],
)
def test_floors_of_parquet_are_numbers_or_text(walk, tmp_path, given, kind, expected):
    table = {name: [value] * 2 for name, value in middle(walk).items()}
    pq.write_table(pa.table(table | {"floor": pa.array(given, kind)}), tmp_path / "q.parquet")
    assert floors(walk, tmp_path / "q.parquet") == expected


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"floor": True}, "floor: True, expected a height in m, or HEIGHT,SLOPE_X,SLOPE_Z"),
        ({"floor": {"height": 1}}, "floor: .* expected a height in m"),
        ({"floor": "1,2"}, "floor: '1,2', expected a height in m"),
        ({"floor": 11}, "floor: 11 m, expected -10 to 10 m"),
        ({"floor": 0.2, "feet": "as_predicted"}, "expected feet that stand"),
        ({"floor": "0,0,0.2", "loop": True}, "expected a level floor"),
    ],
)
def test_rows_that_are_no_floor_are_refused(walk, tmp_path, more, said):
    path = write_jsonl(tmp_path / "q.jsonl", [middle(walk), middle(walk) | more])
    ((place, message),) = faults(walk, path)
    assert place.endswith(":2")
    assert re.search(said, message), message
