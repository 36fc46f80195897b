"""Tests of targets and exact controls in query rows."""

import json
import re

import pytest
from msgspec import structs
from rowing import POINT, faults, rows, source, text, write_csv, write_jsonl, write_parquet

from posefield.batch.rows.row_sources import Defaults
from posefield.common.errors import InvalidField
from posefield.question.motion_question import ClipQuestion, Target
from posefield.registry import model_registry

HELD = ("exact", "targets", "feet")
HAND = {"joint": "RightHand", "position": [-0.2, 1.1, 0.5], "at": "end"}
FOOT = {"joint": "LeftFoot", "position": [0.1, 0, 0.5], "time": 0.25}
BOTH = (
    Target("RightHand", (-0.2, 1.1, 0.5), at="end"),
    Target("LeftFoot", (0.1, 0.0, 0.5), time=0.25),
)
WORDS = "RightHand@end:-0.2,1.1,0.5; LeftFoot@0.25:0.1,0,0.5"


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


def holds(model, path, usual=None):
    """Return the fields of the rows' questions that a plain one lacks."""
    plain = structs.asdict(ClipQuestion(controls={}))
    asked = [structs.asdict(each.question) for each in rows(model, path, usual)]
    return [{k: one[k] for k in HELD if one[k] != plain[k]} for one in asked]


def test_lines_are_held_each_to_its_own(model, tmp_path):
    lines = [
        {**POINT, "targets": [HAND, FOOT]},
        POINT,
        {**POINT, "exact": "none", "feet": None},
        {**POINT, "targets": None, "exact": None},
    ]
    path = write_jsonl(tmp_path / "q.jsonl", lines)
    assert holds(model, path) == [{"targets": BOTH}, {}, {"exact": "none"}, {}]


def test_what_a_row_does_not_say_is_as_usual(model, tmp_path):
    usual = Defaults("usdc", ClipQuestion(controls={}, exact="none", targets=BOTH[1:]))
    path = write_jsonl(tmp_path / "q.jsonl", [POINT, {**POINT, "exact": "auto", "targets": [HAND]}])
    assert holds(model, path, usual) == [
        {"exact": "none", "targets": BOTH[1:]},
        {"targets": BOTH[:1]},
    ]


@pytest.mark.parametrize(("write", "name"), [(write_csv, "q.csv"), (write_parquet, "q.parquet")])
def test_targets_of_tables_are_text(model, tmp_path, write, name):
    said = [{**POINT, "exact": "none", "targets": WORDS}, {**POINT, "exact": None, "targets": None}]
    assert holds(model, write(tmp_path / name, said)) == [{"exact": "none", "targets": BOTH}, {}]


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"targets": "RightHand"}, "targets: 'RightHand', expected targets: JOINT@MOMENT:X,Y,Z"),
        ({"targets": [{**HAND, "time": 0}]}, "targets: .*expected targets: JOINT@MOMENT:X,Y,Z"),
        ({"targets": [{**HAND, "joint": "Tail"}]}, "targets/0/joint: 'Tail', expected one of Hips"),
        ({"targets": [HAND, HAND]}, "targets/1: RightHand at end has a target already"),
        ({"targets": [{**FOOT, "time": 99}]}, "targets/0/time: 99 s, expected 0 to"),
        ({"exact": "turn"}, "exact: 'turn' is not measured on a motion"),
        ({"exact": ["turn"]}, "exact: 'turn' is not measured on a motion"),
        ({"exact": 1}, "exact: 1, expected auto, none or names"),
        ({"feet": "stand"}, "feet: 'stand', but this model's recipe names no feet"),
        ({"feet": "yes"}, "feet: 'yes', expected one of stand, as_predicted"),
    ],
)
def test_rows_that_no_clip_can_be_held_to(model, tmp_path, said, message):
    path = write_jsonl(tmp_path / "q.jsonl", [POINT, {**POINT, **said}, POINT])
    ((place, found),) = faults(model, path)
    assert place == "q.jsonl:2"
    assert re.search(message, found), found


def test_what_holds_for_all_rows_is_looked_at_first(model, tmp_path):
    path = write_jsonl(tmp_path / "q.jsonl", [POINT])
    with pytest.raises(InvalidField, match="exact: 'turn' is not measured on a motion"):
        source(model, path, Defaults("usdc", ClipQuestion(controls={}, exact=("turn",))))


def test_what_clips_are_held_to_is_part_of_the_job(model, tmp_path):
    path = write_jsonl(tmp_path / "q.jsonl", [POINT])
    every = [{}, {"exact": "none"}, {"targets": BOTH}, {"targets": BOTH[:1]}]
    digests = [
        source(model, path, Defaults("usdc", ClipQuestion(controls={}, **hold))).digest
        for hold in every
    ]
    assert len(set(digests)) == len(every)
    other = write_jsonl(tmp_path / "r.jsonl", [{**POINT, "targets": [HAND]}])
    assert source(model, other).digest not in digests
    assert source(model, path).digest == digests[0]


def test_a_grid_of_what_is_exact(model):
    found = rows(model, grid=("exact=auto,none",))
    assert [each.question.exact for each in found] == ["auto", "none"]
    with pytest.raises(InvalidField, match="column 'targets', expected one whose values have no"):
        source(model, grid=("targets=RightHand@end:0,1,0",))


def test_a_cell_that_is_empty_says_nothing(model, tmp_path):
    line = ",".join(f"{value}" for value in POINT.values())
    path = text(tmp_path / "q.csv", ",".join([*POINT, "exact", "targets"]), f"{line},,")
    assert holds(model, path) == [{}]


def test_lines_are_json(model, tmp_path):
    """Accept nested keys of the same name."""
    path = tmp_path / "q.jsonl"
    path.write_text(json.dumps({"controls": POINT, "targets": [HAND, FOOT]}) + "\n")
    assert holds(model, path) == [{"targets": BOTH}]
