"""Tests of query sources: equal rows give equal queries in all file types, and equal validation."""

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs
from rowing import POINT, faults, rows, source, write_csv, write_jsonl, write_parquet

from posefield.batch.rows.row_query import RowFault
from posefield.batch.rows.row_sources import Defaults
from posefield.common.errors import QueryError
from posefield.encode.formats import CLIP_ENCODERS
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips

WRITERS = {"csv": write_csv, "jsonl": write_jsonl, "parquet": write_parquet}
PERFORMERS = ("middle", "short", "tall")
USUAL = Defaults(
    "bvh",
    ClipQuestion(
        controls={}, fps=24.0, extrapolate="warn", start=0.1, end=0.9, performer="short", level=1
    ),
)
# Half of the numbers can be asked for; the others lie near an edge of what can, or far outside.
NUMBERS = st.one_of(
    st.sampled_from([1.7, 0.9, 10.0, 1.0]),
    st.floats(-60, 90),
    st.sampled_from([0.0, 1.62, 1.88, 1e300, -1e9, 5e-324]),
)
ROWS = st.fixed_dictionaries(
    {name: st.one_of(st.just(value), st.just(value), NUMBERS) for name, value in POINT.items()},
    optional={
        "name": st.sampled_from(["a", "A", "b", "c.d", ".x", "a b", "clip-000002", None]),
        "format": st.sampled_from(["usda", "bvh", "fbx", None]),
        "fps": st.sampled_from([30.0, 0.5, 1000.0, 1000.1, None]),
        "level": st.sampled_from([0, 3, 4, -1, None]),
        "start": st.sampled_from([0.0, 0.5, -0.1, 20.0, None]),
        "end": st.sampled_from([0.3, 0.5, 18.5, 18.6, None]),
        "performer": st.sampled_from([*PERFORMERS, "nobody", None]),
        "extrapolate": st.sampled_from(["warn", "refuse", "no", None]),
        "names": st.sampled_from(["own", "vrm", None]),
        "root": st.sampled_from(["travelling", "in_place", None]),
        "loop": st.sampled_from([False, False, True, None]),
        "take": st.sampled_from([0, 7, 999_999_999, 1_000_000_000, -1, None]),
        "variety": st.sampled_from([0.0, 0.5, 1.0, 1.1, -0.1, None]),
        "detail": st.sampled_from([False, True, None]),
    },
)
CYCLES = st.fixed_dictionaries(
    {},
    optional={
        "start": st.sampled_from([0.0, 0.1, None]),
        "end": st.sampled_from([0.3, None]),
        "names": st.sampled_from(["own", "own", "vrm", None]),
        "loop": st.booleans(),
        "feet": st.sampled_from(["stand", "stand", "as_predicted", None]),
        "floor": st.sampled_from([0.0, 0.2, -0.2, 11.0, None]),
    },
)


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture(scope="module")
def walk(walk_path):
    """A model of a cycle whose joints have no roles."""
    return model_registry.load([walk_path]).models["stroll"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("agree")


def plainly(model, table, usual=USUAL):
    """Names, formats and questions of rows, none for one at fault: one row at a time."""
    seen, found = set(), []
    for index, row in enumerate(table):
        said = {key: value for key, value in row.items() if value is not None}
        name, form = said.pop("name", f"clip-{index:06d}"), said.pop("format", usual.format)
        controls = {c.name: said.pop(c.name) for c in model.session.card.controls}
        found.append(None)
        if form not in CLIP_ENCODERS or name in (".x", "a b") or said.get("extrapolate") == "no":
            continue
        question = structs.replace(usual.question, controls=controls, **said)
        try:
            clips.check(model, question)
        except QueryError:
            continue
        if name.lower() not in seen:
            seen.add(name.lower())
            found[-1] = (name, form, question)
    return found


def plain(row):
    return None if isinstance(row, RowFault) else (row.name, row.format, row.question)


@given(table=st.lists(ROWS, min_size=1, max_size=12))
@settings(max_examples=150, deadline=None)
def test_every_file_gives_what_the_door_lets_in(model, folder, table):
    expected = plainly(model, table)
    for ending, write in WRITERS.items():
        found = rows(model, write(folder / f"q.{ending}", table), USUAL)
        assert [plain(row) for row in found] == expected, ending


@given(options=st.lists(CYCLES, min_size=1, max_size=6))
@settings(max_examples=60, deadline=None)
def test_cycles_are_let_in_as_the_door_lets_them(walk, folder, options):
    middle = {control.name: control.default for control in walk.session.card.controls}
    table, usual = [middle | said for said in options], Defaults("bvh")
    expected = plainly(walk, table, usual)
    for ending, write in WRITERS.items():
        found = rows(walk, write(folder / f"w.{ending}", table), usual)
        assert [plain(row) for row in found] == expected, ending


@given(table=st.lists(ROWS, min_size=2, max_size=12))
@settings(max_examples=50, deadline=None)
def test_faults_are_named_alike_but_for_their_places(model, folder, table):
    found = {
        e: faults(model, write(folder / f"f.{e}", table), USUAL) for e, write in WRITERS.items()
    }
    rows_at_fault = [int(place.removeprefix("f.jsonl:")) for place, _ in found["jsonl"]]
    assert [place for place, _ in found["csv"]] == [f"f.csv:{n + 1}" for n in rows_at_fault]
    assert [place for place, _ in found["parquet"]] == [f"f.parquet row {n}" for n in rows_at_fault]
    assert [said for _, said in found["jsonl"]] == [said for _, said in found["parquet"]]


def test_the_rows_above_are_of_both_sorts(model):
    """Negative control: a door that let in all or nothing would be noticed."""
    table = [
        POINT,
        {**POINT, "level": 4},
        {**POINT, "start": 0.5, "end": 0.3},
        {**POINT, "fps": 60.0},
    ]
    found = [row is not None for row in plainly(model, table)]
    assert found == [True, False, False, True]


@pytest.mark.parametrize("ending", WRITERS)
def test_blocks_leave_no_seam(model, tmp_path, ending):
    """Faults at both sides of where one block ends and the next begins, and in the middle of it."""
    table = [{**POINT, "turn": i / 1000, "fps": 30.0} for i in range(10_000)]
    for i in (0, 4095, 4096, 5000, 9999):
        table[i]["fps"] = 0.5
    found = rows(model, WRITERS[ending](tmp_path / f"q.{ending}", table))
    assert [i for i, row in enumerate(found) if isinstance(row, RowFault)] == [
        0,
        4095,
        4096,
        5000,
        9999,
    ]
    kept = [(i, row) for i, row in enumerate(found) if not isinstance(row, RowFault)]
    assert all(row.question.controls["turn"] == i / 1000 for i, row in kept)
    assert all(row.name == f"clip-{i:06d}" for i, row in kept)


@pytest.mark.parametrize(("policy", "edge"), [*product(["warn", "refuse"], ["minimum", "maximum"])])
def test_what_is_read_together_ends_where_the_door_does(model, tmp_path, policy, edge):
    """The door's own bounds to the last bit, many rows about each of them."""
    (turn,) = (c for c in model.session.card.controls if c.name == "turn")
    width = turn.maximum - turn.minimum
    room = width * (100.0 if policy == "warn" else 1e-6)
    middle = getattr(turn, edge) + (room if edge == "maximum" else -room)
    table = [
        {**POINT, "turn": middle + width * 1e-15 * i, "extrapolate": policy} for i in range(-9, 10)
    ]
    found = rows(model, write_jsonl(tmp_path / "q.jsonl", table))
    let_in = []
    for row in table:
        question = ClipQuestion(controls={name: row[name] for name in POINT}, extrapolate=policy)
        try:
            clips.check(model, question)
        except QueryError:
            let_in.append(False)
        else:
            let_in.append(True)
    assert [not isinstance(row, RowFault) for row in found] == let_in
    assert 0 < sum(let_in) < len(let_in)


def test_the_digest_is_of_all_that_queries_hang_on(model, tmp_path):
    path = write_csv(tmp_path / "q.csv", [POINT])
    copy = write_csv(tmp_path / "copy.csv", [POINT])
    other = write_csv(tmp_path / "other.csv", [{**POINT, "turn": 11.0}])
    found = [
        source(model, path).digest,
        source(model, other).digest,
        source(model, path, USUAL).digest,
        source(model, path, Defaults("usda")).digest,
        *(source(model, sample=n, seed=s).digest for n, s in product((5, 6), (0, 1))),
        source(model, sample=5, method="hull").digest,
        *(source(model, grid=(text,)).digest for text in ("turn=1,2", "turn=1,3", "stature=1,2")),
    ]
    assert len(set(found)) == len(found)
    assert all(len(digest) == 64 for digest in found)
    assert source(model, copy).digest == found[0]
    assert source(model, sample=5, method="latin").digest == found[4]
