"""Tests of the choice of a query source (file, grid or sampling), and of early errors."""

import pytest
from rowing import POINT, rows, source, write_csv

from posefield.batch.rows.columns import OPTION_KINDS
from posefield.batch.rows.row_sources import Defaults
from posefield.common.errors import FileError, InvalidField, OutsideSamples, UnknownFormat
from posefield.question.motion_question import ClipQuestion, NamedClipQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture
def table(tmp_path):
    return write_csv(tmp_path / "q.csv", [POINT])


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ({}, "none"),
        ({"grid": ()}, "none"),
        ({"path": True, "grid": ("turn=1",)}, "a file and --grid"),
        ({"path": True, "sample": 5}, "a file and --sample"),
        ({"grid": ("turn=1",), "sample": 0}, "--grid and --sample"),
    ],
)
def test_one_source_is_expected(model, table, asked, found):
    asked = {key: table if value is True else value for key, value in asked.items()}
    with pytest.raises(InvalidField) as caught:
        source(model, **asked)
    assert str(caught.value) == f"queries: {found}, expected one of a file, --grid, --sample"


@pytest.mark.parametrize("option", [{"method": "hull"}, {"seed": 0}])
def test_an_option_of_samplings_is_refused_elsewhere(model, table, option):
    (name,) = option
    for other in ({"path": table}, {"grid": ("turn=1",)}):
        with pytest.raises(InvalidField, match=f"{name}: without --sample, expected with it"):
            source(model, **other, **option)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"sample": 0}, "sample: 0, expected 1 to 1000000000"),
        ({"sample": 10**9 + 1}, "sample: 1000000001, expected 1 to 1000000000"),
        ({"sample": 5, "seed": -1}, "seed: -1, expected 0 or more"),
        ({"sample": 5, "method": "sobol"}, "method: 'sobol', expected one of latin, hull"),
    ],
)
def test_a_sampling_that_cannot_be_drawn_is_refused(model, asked, said):
    with pytest.raises(InvalidField) as caught:
        source(model, **asked)
    assert str(caught.value) == said


@pytest.mark.parametrize(
    ("usual", "fault"),
    [
        (Defaults("fbx"), UnknownFormat),
        (Defaults("usdc", ClipQuestion(controls={}, level=9)), InvalidField),
        (Defaults("usdc", ClipQuestion(controls={}, performer="nobody")), InvalidField),
        (Defaults("usdc", ClipQuestion(controls={}, fps=0.0)), InvalidField),
        (Defaults("usdc", ClipQuestion(controls={}, start=2.0, end=1.0)), InvalidField),
    ],
)
def test_what_rows_do_not_say_is_checked_once(model, table, usual, fault):
    with pytest.raises(fault):
        source(model, table, usual)


def test_a_file_of_no_known_kind_is_refused(model, table):
    other = table.rename(table.with_suffix(".xlsx"))
    with pytest.raises(UnknownFormat) as caught:
        source(model, other)
    assert str(caught.value) == "queries: 'q.xlsx' ends in none of .csv, .jsonl, .ndjson, .parquet"


@pytest.mark.parametrize(("name", "said"), [("no.csv", "No such file"), ("dir.csv", "not a file")])
def test_a_file_that_cannot_be_read_is_refused(model, tmp_path, name, said):
    (tmp_path / "dir.csv").mkdir()
    with pytest.raises(FileError, match=said):
        source(model, tmp_path / name)


def test_every_option_but_name_and_format_is_a_field_of_a_question():
    fields = {*NamedClipQuestion.__struct_fields__, "format"}
    assert fields - set(OPTION_KINDS) == {"controls", "joint_sigma", "labels"}
    assert set(OPTION_KINDS) <= fields


def test_a_refusal_before_a_row_is_the_same_as_in_one(model, table):
    """Apply the command line's options to rows that do not set them."""
    usual = Defaults("usdc", ClipQuestion(controls={}, extrapolate="refuse"))
    beyond = write_csv(table, [{**POINT, "turn": 99.0}])
    (fault,) = rows(model, beyond, usual)
    with pytest.raises(OutsideSamples) as caught:
        clips.check(model, ClipQuestion(controls={**POINT, "turn": 99.0}, extrapolate="refuse"))
    assert fault.message == str(caught.value)
