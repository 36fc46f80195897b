"""Tests of rows: the questions that their cells ask over HTTP, and the same validation."""

import contextlib
import json
import tracemalloc
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs
from rowing import (
    POINT,
    Usual,
    asked,
    columns,
    faults,
    rows,
    source,
    text,
    write_csv,
    write_jsonl,
    write_parquet,
)

from posefield.batch import run
from posefield.batch.rows import RowFault, generated_name, points, repeated_names
from posefield.common.errors import FileError, InvalidField, QueryError
from posefield.encode.formats import CLIP_ENCODERS
from posefield.question import json_decoding, text_decoding
from posefield.question.motion_question import ClipQuestion, Floor, NamedClipQuestion, Target
from posefield.registry import model_registry
from posefield.synthesis import clips

# Writers of tables, the places of their rows, and the number of the first one.
WRITERS = {
    "csv": (write_csv, "q.csv:{}", 2),
    "jsonl": (write_jsonl, "q.jsonl:{}", 1),
    "parquet": (write_parquet, "q.parquet row {}", 1),
}
USUAL = Usual(
    "bvh",
    ClipQuestion(controls={}, fps=24.0, start=0.1, end=0.9, performer="short", level=1),
)
# Half of the numbers can be asked for; the others lie near an edge of what can, or far outside.
NUMBERS = st.one_of(
    st.sampled_from([1.7, 0.9, 10.0, 1.0]),
    st.floats(-60, 90),
    st.sampled_from([0.0, 1.62, 1.88, 1e300, -1e9, 5e-324, None]),
)
ROWS = st.fixed_dictionaries(
    # A table has a column.
    {"turn": NUMBERS},
    optional={
        **{
            name: st.one_of(st.just(value), NUMBERS)
            for name, value in POINT.items()
            if name != "turn"
        },
        "name": st.sampled_from(["a", "A", "b", "c.d", ".x", "a b", "clip-000002", None]),
        "format": st.sampled_from(["usda", "bvh", "fbx", None]),
        "fps": st.sampled_from([30.0, 0.5, 1000.0, 1000.1, None]),
        "level": st.sampled_from([0, 3, 4, None]),
        "start": st.sampled_from([0.0, 0.5, -0.1, 20.0, None]),
        "end": st.sampled_from([0.3, 0.5, 18.5, 18.6, None]),
        "performer": st.sampled_from(["middle", "tall", "nobody", None]),
        "extrapolate": st.sampled_from(["warn", "refuse", "no", None]),
        "names": st.sampled_from(["own", "vrm", None]),
        "root": st.sampled_from(["travelling", "in_place", None]),
        "loop": st.sampled_from([False, True, None]),
        "take": st.sampled_from([0, 7, 999_999_999, None]),
        "variety": st.sampled_from([0.0, 0.5, 1.0, 1.1, None]),
        "detail": st.sampled_from([False, True, None]),
    },
)
HAND = {"joint": "RightHand", "position": [-0.2, 1.1, 0.5], "at": "end"}
TARGETS = (
    Target("RightHand", (-0.2, 1.1, 0.5), at="end"),
    Target("LeftFoot", (0.1, 0.0, 0.5), time=0.25),
)
MIXED = {"marching": 0.75, "plain": 0.25}
# Bytes of a batch of rows, and the names of 30,000.
BOUND = 6e6
MANY = 30_000


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture(scope="module")
def walk(walk_path):
    """A model of a cycle whose joints have no roles."""
    return model_registry.load([walk_path]).models["stroll"]


@pytest.fixture(scope="module")
def styled(styled_path):
    return model_registry.load([styled_path]).models["styled"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rows")


def bodies(model, table, usual=USUAL):
    """Name, format and question of each row as a body over HTTP; None for one that is refused."""
    controls = {control.name for control in model.session.card.controls}
    names, found = set(), []
    for index, row in enumerate(table):
        given = {key: value for key, value in row.items() if value is not None}
        form, name = given.pop("format", usual.format), given.get("name", generated_name(index))
        body = {key: value for key, value in given.items() if key not in controls}
        body["controls"] = {key: value for key, value in given.items() if key in controls}
        found.append(None)
        try:
            asked = json_decoding.decode_question(NamedClipQuestion, json.dumps(body).encode())
        except QueryError:
            continue
        fields = {key: getattr(asked, key) for key in body if key != "name"}
        question = structs.replace(usual.question, **fields)
        if form not in CLIP_ENCODERS or name.lower() in names:
            continue
        names.add(name.lower())
        with contextlib.suppress(QueryError):
            clips.check(model, question)
            found[-1] = (name, form, question)
    return found


@given(table=st.lists(ROWS, min_size=1, max_size=8))
@settings(max_examples=60, deadline=None)
def test_rows_of_all_files_are_bodies_over_http_and_faults_are_named_by_line(model, folder, table):
    """Oracle: decoding and validation of a request."""
    # In one order of cells, of whose faults the first is named.
    table = [{key: row.get(key) for key in columns(table)} for row in table]
    expected, said = bodies(model, table), {}
    for ending, (write, place, first) in WRITERS.items():
        found = rows(model, write(folder / f"q.{ending}", table), USUAL)
        plain = [None if isinstance(r, RowFault) else (r.name, r.format, r.question) for r in found]
        assert plain == expected, ending
        at_fault = [(n, row) for n, row in enumerate(found, first) if isinstance(row, RowFault)]
        assert all(row.place == f"{folder}/{place.format(n)}" for n, row in at_fault)
        said[ending] = [row.message for _, row in at_fault]
    assert said["jsonl"] == said["parquet"]


def test_controls_may_be_left_open(model, tmp_path):
    """A table, a grid and a URL ask the same question; the service chooses the other controls."""
    path = text(tmp_path / "q.csv", "turn,stature", "10,", "20,1.75")
    url = text_decoding.decode_question(ClipQuestion, [("turn", "10")])
    assert [row.question for row in rows(model, path)] == [
        url,
        ClipQuestion(controls={"turn": 20.0, "stature": 1.75}),
    ]
    (point,) = rows(model, grid=("turn=10",))
    assert point.question == url
    first, _ = points(path, model)
    assert first == model.question(url).controls and len(first) == len(POINT)


def test_missing_values_are_those_of_the_command(styled, model, tmp_path):
    path = text(tmp_path / "q.csv", "turn,fps,performer", "10,,", "10,60,tall")
    plain = structs.replace(USUAL.question, controls={"turn": 10.0})
    assert [form for _, form, _ in asked(rows(model, path, USUAL))] == ["bvh", "bvh"]
    assert [question for *_, question in asked(rows(model, path, USUAL))] == [
        plain,
        structs.replace(plain, fps=60.0, performer="tall"),
    ]
    usual = Usual("usdc", ClipQuestion(controls={}, labels={"style": "sneaking"}))
    path = text(tmp_path / "s.csv", "haste,style", "4,plain", "4,")
    labels = [row.question.labels for row in rows(styled, path, usual)]
    assert labels == [{"style": "plain"}, {"style": "sneaking"}]


def test_labels_are_names_or_weights(styled, tmp_path):
    lines = ("4,ann,plain", '4,,"marching:0.75,plain:0.25"', "4,ben,")
    expected = [{"style": "plain"}, {"style": MIXED}, {}]
    for title in ("style", "labels/style"):
        found = rows(styled, text(tmp_path / "q.csv", f"haste,performer,{title}", *lines))
        assert [row.question.labels for row in found] == expected
    assert [row.question.performer for row in found] == ["ann", None, "ben"]
    given = [{"style": "plain"}, {"style": MIXED}, {"style": None}, {"style": "plain:0.5,ann:0"}]
    found = rows(styled, write_jsonl(tmp_path / "q.jsonl", given))
    assert [row.question.labels for row in found[:3]] == expected
    assert isinstance(found[3], RowFault)


def test_floors_are_text_numbers_or_objects(walk, tmp_path):
    plane = Floor(0.1, 0.0, -0.2)
    table = text(tmp_path / "q.csv", "floor,fps", "0.2,30", '"0.1,0,-0.2",30', ",30")
    assert [row.question.floor for row in rows(walk, table)] == [0.2, plane, 0.0]
    given = [0.2, {"height": 0.1, "slope_x": 0, "slope_z": -0.2}, "0.1,0,-0.2", None]
    lines = write_jsonl(tmp_path / "q.jsonl", [{"floor": floor} for floor in given])
    assert [row.question.floor for row in rows(walk, lines)] == [0.2, plane, plane, 0.0]


def test_targets_are_text_or_objects(model, tmp_path):
    words = "RightHand@end:-0.2,1.1,0.5; LeftFoot@0.25:0.1,0,0.5"
    objects = [HAND, {"joint": "LeftFoot", "position": [0.1, 0, 0.5], "time": 0.25}]
    table = [{**POINT, "exact": "none", "targets": words}, {**POINT, "exact": None}]
    for ending, (write, *_) in WRITERS.items():
        first, second = rows(model, write(tmp_path / f"q.{ending}", table))
        assert (first.question.targets, first.question.exact) == (TARGETS, "none")
        assert (second.question.targets, second.question.exact) == ((), "auto")
    path = write_jsonl(tmp_path / "o.jsonl", [{"controls": POINT, "targets": objects}])
    assert rows(model, path)[0].question.targets == TARGETS


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"targets": "RightHand"}, "target: 'RightHand', expected JOINT@MOMENT:X,Y,Z"),
        ({"targets": [{**HAND, "joint": "Tail"}]}, "targets/0/joint: 'Tail', expected one of Hips"),
        ({"exact": "turn"}, "exact: 'turn' is not measured on a motion"),
        ({"turn": "10"}, "controls/turn: Expected `float`, got `str` '10'"),
        ({"format": "fbx"}, "format: 'fbx', expected one of usda, usdc, usdz, "),
        (
            {"turn": 99, "extrapolate": "refuse"},
            "controls: turn = 99 deg lies outside what was sampled, -59.2188 to 87.5 deg",
        ),
    ],
)
def test_a_row_without_an_answer_is_named(model, tmp_path, said, message):
    path = write_jsonl(tmp_path / "q.jsonl", [POINT, {**POINT, **said}, POINT])
    ((place, found),) = faults(model, path)
    assert place == "q.jsonl:2"
    assert found.startswith(message)


@pytest.mark.parametrize("name", ["a/b", "..", ".hidden", "a b", "ä", "a:b", "x" * 101, "walk "])
def test_a_name_that_is_no_file_name_is_named(model, tmp_path, name):
    path = text(tmp_path / "q.csv", "turn,name", "10," + "x" * 100, f"10,{name}")
    assert faults(model, path) == [
        (
            "q.csv:3",
            f"name: {name!r}, expected 1 to 100 of the letters A to Z, digits, '.', '_' and '-', "
            "not '.' first",
        )
    ]


def test_a_repeated_name_is_named(model, tmp_path):
    said = "expected a name of its own: an earlier row has it, capitals count for nothing"
    names = ("walk", "run", "Walk", "", "clip-000003", "run")
    path = text(tmp_path / "q.csv", "turn,name", *(f"10,{name}" for name in names), "x,b", "10,b")
    *repeated, (last, _) = faults(model, path)
    assert repeated == [
        ("q.csv:4", f"name: 'Walk', {said}"),
        ("q.csv:6", f"name: 'clip-000003', {said}"),
        ("q.csv:7", f"name: 'run', {said}"),
    ]
    assert last == "q.csv:8"
    assert list(repeated_names(names)) == [2, 5]


def test_faults_are_counted_and_the_first_are_named(model, tmp_path):
    lines = [f"10,{i % 7}" for i in range(700)]
    opened = source(model, text(tmp_path / "q.csv", "turn,level", *lines))
    with pytest.raises(InvalidField) as caught:
        run.check_rows(opened, skip=False)
    head, *shown, last = str(caught.value).splitlines()
    assert head.startswith("queries: rows that cannot be answered: 300 (--skip-errors")
    assert shown[0] == f"  {tmp_path}/q.csv:6: level: 4, expected 0 to 3"
    assert (len(shown), last) == (20, "  and 280 more")
    assert run.check_rows(opened, skip=True) == 700


def test_a_grid_is_the_product_in_the_order_it_is_given(model):
    texts = ("turn=0:80:17", "stature=1.7,1.75", "performer=tall,short", "format=bvh,usda")
    found = rows(model, grid=texts)
    turns = np.linspace(0, 80, 17).tolist()
    expected = list(product(turns, (1.7, 1.75), ("tall", "short"), ("bvh", "usda")))
    assert [
        (*row.question.controls.values(), row.question.performer, row.format) for row in found
    ] == expected
    assert [row.place for row in found[:2]] == ["grid point 1", "grid point 2"]
    assert found[33].name == "clip-000033"


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (("turn",), "'turn', expected NAME=VALUE,VALUE or NAME=START:STOP:COUNT"),
        (("trun=1",), "'trun=1': unknown column 'trun', did you mean 'turn'?"),
        (("turn=1:2",), "'turn=1:2': '1:2', expected START:STOP:COUNT"),
        (("targets=a",), "'targets=a': column 'targets', expected one whose values have no commas"),
        (("turn=0:1:100000", "stature=1:2:100000"), "10000000000 points, expected at most"),
    ],
)
def test_a_malformed_grid_is_refused(model, texts, said):
    with pytest.raises(InvalidField) as caught:
        source(model, grid=texts)
    assert str(caught.value).startswith(f"grid: {said}")


def test_the_digest_is_of_all_that_determines_queries(model, tmp_path):
    path, copy = (write_csv(tmp_path / name, [POINT]) for name in ("q.csv", "copy.csv"))
    other = write_csv(tmp_path / "other.csv", [{**POINT, "turn": 11.0}])
    asks = [
        *({"path": path, "usual": usual} for usual in (None, USUAL, Usual("usda"))),
        {"path": other},
        *({"sample": n, "seed": s} for n, s in product((5, 6), (0, 1))),
        {"sample": 5, "method": "hull"},
        *({"grid": (text,)} for text in ("turn=1,2", "turn=1,3", "stature=1,2")),
        {"path": path, "usual": Usual("usdc", ClipQuestion(controls={}, targets=TARGETS))},
    ]
    found = [source(model, **ask).digest for ask in asks]
    assert len(set(found)) == len(found)
    assert source(model, copy).digest == found[0]
    assert source(model, sample=5, method="latin").digest == found[4]


def test_a_file_that_changes_while_it_is_read_is_refused(model, tmp_path):
    path = write_csv(tmp_path / "q.csv", [POINT] * 10_000)
    opened = source(model, path)
    assert list(opened.rows()) == list(opened.rows())
    under_way = opened.rows()
    next(under_way)
    with path.open("ab") as file:
        file.write(b"\n")
    with pytest.raises(FileError, match="changed while it was used"):
        next(under_way)
    with pytest.raises(FileError, match="changed while it was used"):
        run.check_rows(opened, skip=True)


@pytest.mark.system
@pytest.mark.parametrize("kind", ["csv", "jsonl", "sample", "grid"])
def test_rows_are_not_held(model, tmp_path, kind):
    lines = {
        "csv": ["turn,name", *(f"{i % 50},walk-{i}" for i in range(MANY))],
        "jsonl": [f'{{"turn": {i % 50}}}' for i in range(MANY)],
    }
    asked = {"sample": {"sample": MANY}, "grid": {"grid": ("turn=0:50:200", "stature=1.7:1.8:150")}}
    ask = asked.get(kind) or {"path": text(tmp_path / f"q.{kind}", *lines[kind])}
    opened = source(model, **ask)
    tracemalloc.start()
    assert sum(1 for _ in opened.rows()) == MANY
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < BOUND
