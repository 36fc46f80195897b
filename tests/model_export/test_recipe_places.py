"""Tests of the lines in errors of recipes."""

import tomllib
from pathlib import Path

import pytest
from minimal import TOML

from posefield.common.errors import RecipeError
from posefield_train.source import recipe
from posefield_train.source.recipe_errors import key_lines

TRICKY = '''
# [not.a.table] = 1
title = "a = [1] # no comment" # a comment = 1
'quoted key' = 'x'
a . b . "c d" = 1.5e3
when = 1979-05-27 07:32:00
[fruit]
list = [
  "one", # first ]
  { name = "two", size = { w = 1 } },
  [3, [4]],
]
text = """
[inside.text]
key = 1
"""
[[fruit.kinds]]
name = "red"
[fruit.kinds.taste]
sweet = true
[[fruit.kinds]]
name = "green"
[[fruit.kinds.seeds]]
count = 2
'''


def paths(value, before=()):
    """Return the paths of all values inside a value."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    found = set()
    for key, inner in items:
        found |= {(*before, key)}
        if isinstance(inner, dict | list):
            found |= paths(inner, (*before, key))
    return found


RECIPES = sorted((Path(recipe.__file__).parents[1] / "recipes").glob("*.toml"))


@pytest.mark.parametrize("text", [TRICKY, TOML, RECIPES[0].read_text()])
def test_keys_of_tables_that_tomllib_reads_have_a_line(text):
    """Oracle: tomllib."""
    known, wanted = set(key_lines(text)), paths(tomllib.loads(text))
    assert known <= wanted
    tables = {path for path in wanted if len(path) <= 2 and all(isinstance(p, str) for p in path)}
    assert tables <= known | {("controls",), ("fruit", "kinds")}


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (("title",), "title ="),
        (("a", "b", "c d"), "a . b"),
        (("fruit", "list"), "list ="),
        (("fruit", "kinds", 1, "name"), 'name = "green"'),
        (("fruit", "kinds", 1, "seeds", 0, "count"), "count ="),
    ],
)
def test_a_line_is_where_the_key_begins(path, words):
    assert TRICKY.splitlines()[key_lines(TRICKY)[path] - 1].startswith(words)


@pytest.fixture
def refused(tmp_path):
    """Function that returns the lines of a recipe's error, without the path."""
    path = tmp_path / "recipe.toml"

    def of(text):
        path.write_text(text)
        with pytest.raises(RecipeError) as caught:
            recipe.read(path)
        return [line.removeprefix(f"{path}:") for line in str(caught.value).split("\n")]

    return of


def line_of(text, words):
    return text[: text.index(words)].count("\n") + 1


def test_every_mistake_has_its_line(refused):
    text = TOML.replace('up = "y"', 'up = "x"').replace("frames = 20", "framez = 20")
    first, second, third = refused(text)
    assert first.startswith(f"{line_of(text, 'up =')}: source.up: Input should be 'y' or 'z'")
    # The missing key at its table, the unknown one at itself.
    assert second.startswith(f"{line_of(text, 'motion]')}: motion.frames: Field required")
    hint = "(did you mean 'frames'?), found 20; expected some of frames, cyclic, root"
    assert third.startswith(f"{line_of(text, 'framez')}: motion.framez: Extra inputs")
    assert hint in third


def test_a_missing_key_of_no_table_is_at_the_top(refused):
    assert refused(TOML.replace("schema = 1\n", "")) == ["1: schema: Field required"]


def test_a_mistake_of_our_own_checks_has_its_key_and_no_words_of_pydantic(refused):
    text = TOML.replace("[size]", '[event]\njoint = "hand"\nat = "hightest"\n[size]')
    (line,) = refused(text)
    at = line_of(text, "at = ")
    expected = (
        "found 'hightest' (did you mean 'highest'?), expected 'start', 'end', 'highest', 'lowest', "
        "'farthest' or a column of clips.landmarks []"
    )
    assert line == f"{at}: event.at: {expected}"


def test_an_unknown_key_of_a_control_is_answered_with_those_of_its_kind(refused):
    text = TOML.replace("[[controls]]\n", "[[controls]]\ncolum = 3\n")
    (line,) = refused(text)
    assert line.startswith(f"{line_of(text, 'colum =')}: controls.0.colum: ")
    assert line.endswith("expected some of name, column, unit, description")


def test_the_number_of_listed_mistakes_is_bounded(refused):
    lines = refused("".join(f"key{number} = 1\n" for number in range(100)) + TOML)
    assert len(lines) == 21 and lines[-1] == " 80 further mistakes"
