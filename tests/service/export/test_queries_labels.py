"""Tests of tables with labels: a column for each label set, names and weights, errors."""

import json
import re

import pytest
from rowing import faults, rows, source, text, write_jsonl

from posefield.batch.rows.row_sources import Defaults
from posefield.common.errors import FileError, InvalidField
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry

MIXED = {"marching": 0.75, "plain": 0.25}


@pytest.fixture(scope="module")
def model(styled_path):
    return model_registry.load([styled_path]).models["styled"]


def labels(found):
    return [each.question.labels for each in found]


def test_each_label_set_is_a_column_of_names_or_weights(model, tmp_path):
    heading = "haste,veer,performer,style"
    lines = ("4,0,ann,plain", '4,0,,"marching:0.75,plain:0.25"', "4,0,ben,")
    found = rows(model, text(tmp_path / "q.csv", heading, *lines))
    assert labels(found) == [{"style": "plain"}, {"style": MIXED}, {}]
    assert [each.question.performer for each in found] == ["ann", None, "ben"]
    other = text(tmp_path / "o.csv", heading.replace("style", "labels/style"), *lines)
    assert labels(rows(model, other)) == labels(found)


def test_weights_are_objects_in_json(model, tmp_path):
    point = {"haste": 4.0, "veer": 0.0}
    given = [{**point, "style": "plain"}, {**point, "style": MIXED}, {**point, "style": None}]
    found = rows(model, write_jsonl(tmp_path / "q.jsonl", given))
    assert labels(found) == [{"style": "plain"}, {"style": MIXED}, {}]


def test_an_empty_cell_takes_the_option(model, tmp_path):
    usual = Defaults("usdc", ClipQuestion(controls={}, labels={"style": "sneaking"}))
    path = text(tmp_path / "q.csv", "haste,veer,style", "4,0,plain", "4,0,")
    found = list(source(model, path, usual).rows())
    assert labels(found) == [{"style": "plain"}, {"style": "sneaking"}]


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("plane", "style: 'plane', expected one of marching, plain, sneaking, or NAME:WEIGHT"),
        ('"plain:0.5,plain:0.5"', "style: 'plain:0.5,plain:0.5', expected one of marching"),
        ('"plain:0.75,marching:0.5"', "labels/style: weights with a sum of 1.25"),
        ("plain:-0.5", "labels/style/plain: -0.5, expected a weight of 0 to 1"),
    ],
)
def test_a_wrong_label_is_the_fault_of_its_row(model, tmp_path, cell, said):
    lines = ("haste,veer,style", "4,0,plain", f"4,0,{cell}", "4,0,")
    ((place, message),) = faults(model, text(tmp_path / "q.csv", *lines))
    assert place == "q.csv:3" and message.startswith(said)


def test_a_wrong_option_is_refused_before_any_row(model, tmp_path):
    usual = Defaults("usdc", ClipQuestion(controls={}, labels={"style": "plane"}))
    path = text(tmp_path / "q.csv", "haste,veer", "4,0", "5,0")
    with pytest.raises(InvalidField, match=re.escape("(did you mean 'plain'?)")):
        source(model, path, usual)


def test_an_unknown_column_is_refused_with_the_most_similar(model, tmp_path):
    with pytest.raises(FileError, match="unknown column 'stile', did you mean 'style'"):
        source(model, text(tmp_path / "q.csv", "haste,veer,stile", "4,0,plain"))


def test_an_export_writes_the_labels_to_its_manifest(posefield, styled_path, tmp_path):
    table = text(tmp_path / "q.csv", "haste,veer,style", "4,0,plain", "4,0,")
    out = tmp_path / "out"
    asked = (table, "-o", out, "--format", "json", "--label", "performer=ann:0.5")
    code, _, err = posefield("export", styled_path, *asked)
    assert code == 0, err
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    mixture = {"performer": {"ann": 0.5}}
    assert [line["labels"] for line in lines] == [mixture | {"style": "plain"}, mixture]
