"""Tests of grids: all combinations of values, the last axis fastest."""

from itertools import product

import numpy as np
import pytest
from rowing import asked, rows, source

from posefield.batch.rows.row_query import RowFault
from posefield.batch.rows.row_sources import Defaults
from posefield.common.errors import InvalidField
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


def test_a_grid_is_the_product_in_the_order_it_is_given(model):
    texts = ("turn=0:80:17", "stature=1.7,1.75", "hip_height=0.9")
    opened = source(model, grid=texts)
    found = list(opened.rows())
    height = model.session.card.control("target_height").default
    expected = [
        {"stature": stature, "hip_height": 0.9, "turn": turn, "target_height": height}
        for turn, stature in product(np.linspace(0, 80, 17).tolist(), (1.7, 1.75))
    ]
    assert [row.question for row in found] == [ClipQuestion(controls=point) for point in expected]
    assert opened.survey().total == len(found) == 34
    assert [row.place for row in found[:2]] == ["grid point 1", "grid point 2"]
    assert found[33].name == "clip-000033"


def test_an_axis_may_be_any_column_that_clips_share(model):
    texts = ("performer=tall,short", "level=0:2:3", "format=bvh,usda")
    found = asked(rows(model, grid=texts))
    expected = product(("tall", "short"), (0, 1, 2), ("bvh", "usda"))
    assert [(q.performer, q.level, form) for _, form, q in found] == list(expected)


def test_ends_are_met_exactly(model):
    found = rows(model, grid=("turn=0.1:0.7:7",))
    values = [row.question.controls["turn"] for row in found]
    assert (values[0], values[-1], len(values)) == (0.1, 0.7, 7)


def test_blocks_of_a_grid_leave_no_seam(model):
    found = rows(model, grid=("turn=0:50:101", "stature=1.7:1.8:101"))
    turns = [row.question.controls["turn"] for row in found]
    assert turns == sorted(turns)
    points = {tuple(row.question.controls.values()) for row in found}
    assert len(points) == len(found) == 101 * 101


def test_a_point_that_cannot_be_asked_for_is_a_fault(model):
    usual = Defaults("usdc", ClipQuestion(controls={}, extrapolate="refuse"))
    found = rows(model, usual=usual, grid=("turn=80:90:3",))
    assert [isinstance(row, RowFault) for row in found] == [False, False, True]
    assert found[2].place == "grid point 3"
    assert found[2].message.startswith("controls: turn = 90 deg lies outside what was sampled")


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (("turn",), "'turn', expected NAME=VALUE,VALUE or NAME=START:STOP:COUNT"),
        (("turn=",), "'turn=', expected NAME=VALUE,VALUE or NAME=START:STOP:COUNT"),
        (("trun=1",), "'trun=1': unknown column 'trun', did you mean 'turn'?"),
        (("turn=1", "turn=2"), "'turn' twice, expected once"),
        (("turn=1", "turn [deg]=2"), "'turn' twice, expected once"),
        (("turn [rad]=1",), "'turn [rad]=1': column 'turn' in the unit 'rad', expected deg"),
        (("turn=1,x",), "'turn=1,x': turn: 'x', expected a number in deg"),
        (("turn=1,",), "'turn=1,': turn: empty, expected a number in deg"),
        (("fps=30,",), "'fps=30,': an empty value, expected a number in frames a second"),
        (("performer=Tall",), "'performer=Tall': performer: 'Tall', expected one of middle, "),
        (("level=0:1:3",), "'level=0:1:3': level: 0.5, expected a whole number"),
        (("turn=1:2",), "'turn=1:2': '1:2', expected START:STOP:COUNT"),
        (("turn=1:2:1",), "'turn=1:2:1': '1:2:1', expected START:STOP:COUNT with a COUNT of 2 to"),
        (("turn=1:2:2.5",), "'turn=1:2:2.5': '1:2:2.5', expected START:STOP:COUNT"),
        (("turn=1:x:3",), "'turn=1:x:3': '1:x:3', expected START:STOP:COUNT"),
        (("turn=1::3",), "'turn=1::3': '1::3', expected START:STOP:COUNT with"),
        (("turn=0:1:1000000000",), "'turn=0:1:1000000000': "),
        (("name=a,b",), "'name=a,b': column 'name', expected one that clips may share"),
        (
            ("turn=0:1:1000", "stature=1:2:1000", "hip_height=0:1:1001"),
            "1001000000 points, expected at most 1000000000",
        ),
    ],
)
def test_a_grid_that_is_none_is_refused(model, texts, said):
    with pytest.raises(InvalidField) as caught:
        source(model, grid=texts)
    assert str(caught.value).startswith(f"grid: {said}")
