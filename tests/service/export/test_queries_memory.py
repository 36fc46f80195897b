"""Tests of memory: one block of rows is in memory at a time."""

import tracemalloc

import pytest
from rowing import POINT, source, text, write_csv

from posefield.batch.rows.row_sources import Defaults
from posefield.registry import model_registry

pytestmark = pytest.mark.system

# Bytes of a block of 4096 rows as lines, cells and values; names take 8 each beside it.
BOUND = 12e6
ROWS = 60_000


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


def peak(work):
    """Bytes that work holds at most, beyond what there was."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def look(opened, read):
    """Count rows, by a survey or by reading them."""
    if read == "survey":
        return opened.survey().total
    return sum(1 for _ in opened.rows())


@pytest.mark.parametrize("read", ["survey", "rows"])
@pytest.mark.parametrize("kind", ["csv", "latin", "hull", "grid"])
def test_rows_are_not_held(model, tmp_path, kind, read):
    asked = {
        "csv": {"path": tmp_path / "q.csv"},
        "latin": {"sample": ROWS, "method": "latin"},
        "hull": {"sample": ROWS, "method": "hull"},
        "grid": {"grid": ("turn=0:50:200", "stature=1.7:1.8:300")},
    }[kind]
    if kind == "csv":
        lines = (f"1.7,0.9,{i % 50},1.0,walk-{i}" for i in range(ROWS))
        text(tmp_path / "q.csv", ",".join([*POINT, "name"]), *lines)
    opened = source(model, usual=Defaults("usdc"), **asked)
    assert peak(lambda: look(opened, read)) < BOUND


def test_rows_that_are_held_would_be_noticed(model):
    """Negative control of the test above."""
    opened = source(model, sample=ROWS)
    assert peak(lambda: list(opened.rows())) > 2 * BOUND


def test_rows_that_are_all_at_fault_are_not_held(model, tmp_path):
    path = write_csv(tmp_path / "q.csv", [{**POINT, "level": 9}] * 10_000)
    opened = source(model, path)
    assert peak(opened.survey) < BOUND
    assert opened.survey().faulty == 10_000


def test_five_times_the_rows_need_no_more(model):
    few, many = (source(model, sample=n) for n in (ROWS, 5 * ROWS))
    assert peak(many.survey) < 1.1 * peak(few.survey)
