"""Tests of the tables of results: equal information, pooled rows, and families without a file."""

import json
import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
sys.path[:0] = [str(DOCS), str(DOCS.parent / "benchmarks")]

import equal_tables  # noqa: E402
import evaluation_summary  # noqa: E402
import evaluation_tables  # noqa: E402
import measure_models  # noqa: E402
import measured_tables  # noqa: E402
import result_tables  # noqa: E402
from rows import Row, compact, record  # noqa: E402


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


def test_calibration_has_a_column_for_each_family(folder):
    rows = list(equal_tables.calibration())
    assert rows[0][:3] == ["sigma ratio", "1.10", "1.10"]
    assert rows[1][1:3] == ["10.0 %", "10.0 %"]
    assert {len(cells) for cells in rows} == {4}


MEASURED = [name for name in result_tables.SPEED if measured_tables.exists(name)]
UNMEASURED = {*result_tables.SPEED} - {*MEASURED}
PAGES = ("quality", "speed", "targets", "support", "discovery")


def test_tables_of_speed_without_a_file_are_named():
    text = (DOCS / "results/speed.md").read_text()
    assert "Not measured with this version: " in text
    for each in tables("speed"):
        heading = f"\n## {each['title']}\n"
        assert (heading in text) == (each["from"] in {*MEASURED, "levels"})


def tables(name):
    return json.loads((DOCS / f"results/{name}.json").read_text())["tables"]


@pytest.mark.parametrize("name", PAGES)
def test_every_table_of_a_page_is_made_of_a_file(name):
    """A page's own file names tables, and has neither rows nor columns."""
    for each in tables(name):
        assert set(each) == {"title", "about", "from", "remarks"}
        assert each["from"] in result_tables.TABLES


@pytest.mark.parametrize("name", sorted({*result_tables.ORIGINS.values()} - UNMEASURED))
def test_every_figure_has_an_origin(name):
    found = json.loads((DOCS / f"results/{name}.json").read_text())
    assert re.fullmatch(r"\d{4}-\d\d-\d\d(/\d{4}-\d\d-\d\d)?", found["date"])
    assert found["machine"]
    # Commands of this project, whose files are there.
    words = found["command"].split()
    scripts = [word for word in words if word.endswith((".py", ".ts"))]
    assert words[0] == "posefield" or all((DOCS.parent / each).exists() for each in scripts)


FIGURE = re.compile(r"\d[\d,]*(?:\.\d+)?")


@pytest.mark.parametrize("name", ["recipes", "levels", *MEASURED])
def test_every_cell_of_a_measured_table_is_from_its_file(name, tmp_path, monkeypatch):
    """A table shows other figures where its file has others."""
    columns, rows = result_tables.TABLES[name]()
    before = [columns, *rows]
    source = result_tables.ORIGINS[name]
    found = json.loads((DOCS / f"results/{source}.json").read_text())
    (tmp_path / "speed").mkdir()
    (tmp_path / f"{source}.json").write_text(json.dumps(scaled(found)))
    monkeypatch.setattr(measured_tables, "FOLDER", tmp_path)
    columns, rows = result_tables.TABLES[name]()
    changed = zip(before, [columns, *rows], strict=True)
    # The first column names the row, and that of baselines has words of the file.
    cells = [pair for old, new in changed for pair in [*zip(old, new, strict=True)][1:]]
    words = {row.get("baseline") for row in found.get("rows", [])}
    shown = [pair for pair in cells if FIGURE.match(pair[0]) and pair[0] not in words]
    # 0 stays 0 when it is scaled.
    assert shown and [old for old, new in shown if old == new and not old.startswith("0 ")] == []


def test_the_words_of_a_table_of_speed_are_those_of_its_file():
    for name in MEASURED:
        rows = measured_tables.read(name)["rows"]
        shown = list(measured_tables.speed(name))
        assert [each[0] for each in shown if each[0] != "the same"] == list(
            dict.fromkeys(row["name"] for row in rows)
        )
        assert [each[2] for each in shown] == [row["baseline"] for row in rows]


def scaled(node):
    """A file whose numbers are seven times as large, and whose words are the same."""
    if isinstance(node, dict):
        return {key: scaled(value) for key, value in node.items()}
    if isinstance(node, list):
        return [scaled(each) for each in node]
    is_number = isinstance(node, int | float) and not isinstance(node, bool)
    return 7 * node if is_number else node


def test_rows_are_told_with_their_verdict_and_a_subject_once(tmp_path, monkeypatch):
    (tmp_path / "speed").mkdir()
    made = [
        Row("a pose", 2.0, "µs", "ours before", 4.54, 5.0),
        Row("a pose", 2.0, "µs", "theirs", 12.8, 5.0),
        Row("clips", 1330.0, "clips/s", "", None, 1000.0),
    ]
    record({"training": made}, "python benchmarks/bench.py --record", tmp_path / "speed")
    monkeypatch.setattr(measured_tables, "FOLDER", tmp_path)
    assert list(measured_tables.speed("speed/training")) == [
        ["a pose", "2 µs", "ours before", "4.54", "5 times, **missed**"],
        ["the same", "", "theirs", "12.8", "5 times, met"],
        ["clips", "1,330 clips/s", "", "", "1,000 clips/s, **missed**"],
    ]
    assert measured_tables.origin("speed/training").startswith(
        "Measured by `python benchmarks/bench.py --record`, 20"
    )


def test_the_figures_of_models_are_those_of_the_shipped_files():
    """After a training: docs/measure_models.py, then docs/generate.py."""
    found = {each["name"]: each for each in measured_tables.read("models")["models"]}
    for file in (DOCS.parent / "service/posefield/shipped").glob("*.onnx"):
        own = measure_models.figures(file)
        assert json.loads(json.dumps(own)) == found[own["name"]]


def test_the_table_of_feet_is_that_of_the_files(folder):
    folder_file = evaluation_tables.FOLDER / "one.json"
    found = json.loads(folder_file.read_text())
    skate = {"predicted": 2.0, "standing": 0.25, "locked": 1.5}
    ratios = dict.fromkeys(("skate", "weighted_skate"), skate)
    ratios |= {key: {"predicted": 1.0, "standing": 1.1} for key in ("acceleration", "knee_peak")}
    costs = {"predicted_error_cm": 5.0, "standing_error_cm": 5.1, "lowered_worst_cm": 4.0}
    folder_file.write_text(json.dumps(found | {"feet": ratios | costs}))
    evaluation_tables.protocols.cache_clear()
    assert evaluation_tables.feet_families() == ["one"], "the other family has none"
    cells = [row[1] for row in evaluation_tables.feet()]
    changes = [
        "2.00 → 0.25",
        "2.00 → 0.25",
        "1.50",
        "1.50",
        "5.00 → 5.10",
        "1.00 → 1.10",
        "1.00 → 1.10",
        "4.0",
    ]
    assert cells == changes


def test_takes_stand_beside_their_negative_controls(folder):
    assert evaluation_tables.take_families() == [] and len(list(evaluation_tables.takes())) == 9
    fields = {
        "variogram": [0.98, 1.02],
        "variance": 1.01,
        "mean_in_standard_errors": 1.0,
        "controls": {
            "variogram_of_half_scales": [0.5, 0.9],
            "variance_without_conditioning": 6.0,
            "mean_in_standard_errors_of_equal_errors": 4.0,
        },
    }
    answers = {"predicted": 0.9, "take": 1.0, "sliding": 1.5, "unlimited": 2.0}
    moving = dict.fromkeys(("acceleration", "skate", "weighted_skate"), answers)
    for name, takes in {"one": fields, "two": fields | {"clips": 9} | moving}.items():
        (folder / f"{name}.json").write_text(json.dumps(family(2.0) | {"takes": takes}))
    evaluation_tables.protocols.cache_clear()
    # Of the other family only the fields were measured: its clips have no feet.
    assert evaluation_tables.take_families() == ["two"]
    rows = {cells[0]: cells[1] for cells in evaluation_tables.takes()}
    assert rows["variance over kriging variance (without conditioning)"] == "1.01 (6.0)"
    taken = "acceleration of a take over captured (all time functions varied)"
    assert rows[taken] == "1.00 (2.00)"
    assert rows["acceleration with detail over captured (without)"] == ""


def test_judged_rows_have_a_verdict_for_goal_and_wish(tmp_path, monkeypatch):
    made = [
        Row("strides: missed", 1.0, "%", "of 92", None, 2.0),
        Row("example: found", 3.0, "s", "", None, None),
    ]
    record({"discovered": made}, "python benchmarks/discovery.py", tmp_path)
    monkeypatch.setattr(measured_tables, "FOLDER", tmp_path)
    assert list(measured_tables.judged("discovered")) == [
        ["strides: missed", "1 %", "2 %, met", "0 %, **missed**", "of 92"],
        ["example: found", "3 s", "", "", ""],
    ]


def test_a_summary_shows_what_the_result_shows(folder):
    """Figures of tables stay; figures of single joints and clips leave."""
    whole = family(2.0) | {"joint_sigma_ratio": {"Hips": 1.0}, "family": "one"}
    whole["methods"]["gp"] = {"relative_cm": 2.0, "global_cm": 3.0, "distances_cm": {"p95": 4.0}}
    short = evaluation_summary.summary(whole)
    assert short["methods"]["gp"] == {"relative_cm": 2.0, "global_cm": 3.0}
    assert not {"joint_sigma_ratio", "family"} & short.keys()
    before = [*equal_tables.best("known"), *equal_tables.pooled("known")]
    for name in ("one", "two"):
        file = folder / f"{name}.json"
        found = json.loads(file.read_text())
        file.write_text(json.dumps(evaluation_summary.summary(found) | {"others": []}))
    evaluation_tables.protocols.cache_clear()
    assert before == [*equal_tables.best("known"), *equal_tables.pooled("known")]


def test_files_of_results_have_a_line_for_each_row():
    value = {"rows": [{"name": "a" * 150, "value": n} for n in range(3)], "short": [1, 2]}
    text = compact(value)
    assert json.loads(text) == value
    assert len(text.splitlines()) == 3 + 5
