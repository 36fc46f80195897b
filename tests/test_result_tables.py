"""Tests of the tables of results: equal information, pooled rows, and families without a file."""

import json
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
sys.path[:0] = [str(DOCS), str(DOCS.parent / "benchmarks")]

import equal_tables  # noqa: E402
import evaluation_tables  # noqa: E402
import measure_models  # noqa: E402
import measured_tables  # noqa: E402
import result_tables  # noqa: E402


def row(ours, theirs, error, verdict, peer="gp"):
    return {
        "posefield": ours,
        "peer": peer,
        "error": theirs,
        "difference": theirs - ours,
        "standard_error": error,
        "verdict": verdict,
    }


def family(scale):
    """Result in which posefield is 10 % nearer than gp and 20 % farther than a mean."""
    peers = {
        "gp": {"relative": row(0.9 * scale, scale, 0.02 * scale, "better")},
        "mean_no_performer": {"relative": row(0.9 * scale, 0.75 * scale, 0.02 * scale, "worse")},
    }
    best = {"relative": {**peers["mean_no_performer"]["relative"], "peer": "mean_no_performer"}}
    own = {"posefield": "posefield", "takes": 5, "best": best, "peers": peers}
    methods = {"posefield": {"duration_error": 0.1, "acceleration_ratio": 1.0, "skate_ratio": None}}
    return {
        "protocol": "leave_one_clip_out",
        "clips": 9,
        "sigma_ratio": 1.1,
        "methods": methods,
        "equal_information": {"known": own},
        "others": [],
    }


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Two families with results."""
    names = {"one": "first", "two": "second"}
    for name, scale in zip(names, (2.0, 8.0), strict=True):
        (tmp_path / f"{name}.json").write_text(json.dumps(family(scale)))
    monkeypatch.setattr(evaluation_tables, "FOLDER", tmp_path)
    monkeypatch.setattr(evaluation_tables, "FAMILIES", names)
    monkeypatch.setattr(equal_tables, "FAMILIES", names)
    evaluation_tables.protocols.cache_clear()
    yield tmp_path
    evaluation_tables.protocols.cache_clear()


def test_bad_rows_are_shown_and_counted(folder):
    rows = list(equal_tables.best("known"))
    assert [cells[0] for cells in rows] == ["first (5)", "second (5)"]
    assert rows[0][2:] == [
        "1.80", "mean without the performer", "1.50", "-0.30 ± 0.04", "**worse**"
    ]  # fmt: skip
    assert equal_tables.counts("known").endswith("0 better, 0 within one standard error, 2 worse.")
    assert list(equal_tables.best("open")) == []


def test_the_pooled_rival_is_one_peer_for_all_families(folder):
    (cells,) = equal_tables.pooled("known")
    assert cells[1] == "mean without the performer"
    # A ratio of 1.2 in both families; errors of 2.67 % each, of a mean of two.
    assert cells[2] == f"+20.0 ± {100 * 1.2 * (2**0.5) * (0.02 / 0.75) / 2:.1f} %"
    assert cells[3] == "**worse**"


MEASURED = [name for name in result_tables.SPEED if measured_tables.exists(name)]


def test_tables_of_speed_without_a_file_are_named():
    text = (DOCS / "results/speed.md").read_text()
    assert "Not measured with this version: " in text
    for each in tables("speed"):
        heading = f"\n## {each['title']}\n"
        assert (heading in text) == (each["from"] in {*MEASURED, "levels"})


def tables(name):
    return json.loads((DOCS / f"results/{name}.json").read_text())["tables"]


def test_the_figures_of_models_are_those_of_the_shipped_files():
    """After a training: docs/measure_models.py, then docs/generate.py."""
    found = {each["name"]: each for each in measured_tables.read("models")["models"]}
    for file in (DOCS.parent / "service/posefield/shipped").glob("*.onnx"):
        own = measure_models.figures(file)
        assert json.loads(json.dumps(own)) == found[own["name"]]
