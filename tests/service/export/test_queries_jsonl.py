"""Tests of JSON Lines: one object per line, with controls inline or nested."""

import json

import pytest
from rowing import POINT, asked, faults, rows, source

from posefield.common.errors import FileError
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry

OK = json.dumps(POINT)


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture
def wrong(model, tmp_path):
    """Function that gives the message of a line among others that are right."""

    def of(line):
        path = tmp_path / "q.jsonl"
        path.write_text(f"{OK}\n\n{line}\n{OK}\n")
        ((place, message),) = faults(model, path)
        assert place == "q.jsonl:3"
        return message

    return of


@pytest.mark.parametrize(
    "line",
    [
        OK,
        json.dumps({"controls": POINT}),
        json.dumps({"turn": 10, "controls": {k: v for k, v in POINT.items() if k != "turn"}}),
        json.dumps({f"controls/{name}": value for name, value in POINT.items()}),
        OK.replace("stature", "stature [m]"),
        OK[:-1] + ', "performer": null, "end": null, "name": null}',
        f"  {OK}  \r",
        "\ufeff" + OK,
    ],
)
def test_a_line_asks_for_a_clip(model, tmp_path, line):
    path = tmp_path / "q.jsonl"
    path.write_text(line, newline="")
    assert asked(rows(model, path)) == [("clip-000000", "usdc", ClipQuestion(controls=POINT))]


def test_lines_may_say_different_things(model, tmp_path):
    lines = [{**POINT, "fps": 60}, {"controls": POINT, "name": "a"}, {"level": 1.0, **POINT}]
    path = tmp_path / "q.ndjson"
    path.write_text("\n".join(map(json.dumps, lines)))
    assert asked(rows(model, path)) == [
        ("clip-000000", "usdc", ClipQuestion(controls=POINT, fps=60.0)),
        ("a", "usdc", ClipQuestion(controls=POINT)),
        ("clip-000002", "usdc", ClipQuestion(controls=POINT, level=1)),
    ]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("{", "not JSON: "),
        ('{"turn": NaN}', "not JSON: "),
        ("[1, 2]", "[1, 2], expected an object"),
        ("7", "7, expected an object"),
        (OK.replace("turn", "trun"), "unknown column 'trun', did you mean 'turn'?"),
        ('{"turn": 1}', "no column 'stature', expected one of numbers in m; found ['turn']"),
        (OK.replace("stature", "stature [cm]"), "column 'stature' in the unit 'cm', expected m"),
        (OK[:-1] + ', "turn": 1}', "'turn' twice, expected once"),
        (OK[:-1] + ', "turn [deg]": 1}', "column 'turn' twice, expected once"),
        (OK[:-1] + ', "controls": {"turn": 1}}', "column 'turn' twice, expected once"),
        ('{"controls": {"turn": 1, "turn": 2}}', "'turn' twice, expected once"),
        (OK[:-1] + ', "name": "a:b", "name": "b"}', "'name' twice, expected once"),
        ('{"controls": [1]}', "controls: [1], expected an object"),
        ('{"controls": 1}', "controls: 1, expected an object"),
        ('{"controls": null}', "controls: None, expected an object"),
        (OK.replace("10.0", '"10"'), "turn: '10', expected a number in deg"),
        (OK.replace("10.0", "true"), "turn: True, expected a number in deg"),
        (OK.replace("10.0", "null"), "turn: empty, expected a number in deg"),
        (OK.replace("10.0", "[10]"), "turn: [10], expected a number in deg"),
        (OK.replace("10.0", "1" + 400 * "0"), "not JSON: "),
        (OK[:-1] + ', "level": 0.5}', "level: 0.5, expected a whole number"),
        (OK[:-1] + ', "level": "0"}', "level: '0', expected a whole number"),
        (OK[:-1] + ', "name": 7}', "name: 7, expected 1 to 100 of"),
        (OK[:-1] + ', "name": ["a"]}', "name: ['a'], expected 1 to 100 of"),
        (OK[:-1] + ', "performer": {"a": 1}}', "performer: {'a': 1}, expected one of middle"),
        (OK[:-1] + ', "x": ":' + "a" * 999 + '"}', "unknown column 'x', expected one of"),
        (
            OK[:-1] + ', "name": "' + "a" * 999 + '"}',
            "name: '" + "a" * 199 + "..., expected 1 to 100",
        ),
        ('{"a": "::", "b": ' + "[" * 1020 + "]" * 1020 + "}", ""),
    ],
)
def test_a_line_that_is_no_query_is_named(wrong, line, said):
    assert wrong(line).startswith(said)


def test_a_colon_in_a_string_is_no_key(model, tmp_path):
    """Negative control of keys that are there twice."""
    path = tmp_path / "q.jsonl"
    path.write_text(OK[:-1] + ', "performer": ":::"}')
    ((_, message),) = faults(model, path)
    assert message == "performer: ':::', expected one of middle, short, tall"


def test_a_list_over_many_lines_is_no_json_lines(model, tmp_path):
    path = tmp_path / "q.jsonl"
    path.write_text(json.dumps([POINT], indent=1))
    survey = source(model, path).survey()
    assert survey.faulty == survey.total == 8


def test_a_file_without_line_ends_is_refused(model, tmp_path):
    path = tmp_path / "q.jsonl"
    path.write_text("[" + f"{OK}," * 20_000)
    with pytest.raises(FileError, match=r"q.jsonl:1: a line of 1048576 characters or more"):
        source(model, path).survey()
