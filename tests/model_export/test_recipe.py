"""Tests of recipes: valid ones, and errors that name the invalid key with its line."""

import json
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest
from minimal import TOML

from posefield.common.errors import RecipeError
from posefield_train.source import control_sources, recipe
from posefield_train.source.recipe import key_lines

RECIPES = Path(recipe.__file__).parents[1] / "recipes"
MINIMAL = TOML.replace("metres_per_unit = 1.0", "metres_per_unit = 0.01")
SECOND = """[[controls]]
name = "speed"
column = "w"
unit = "m"
description = "Another"
"""
COLUMN = 'column = "v"\nunit = "m/s"\n'


def measured(auto, changes=()):
    """The least recipe with its control measured; changes: pairs of texts, old and new."""
    text = MINIMAL.replace(COLUMN, f"auto = {auto}\n")
    for old, new in changes:
        text = text.replace(old, new)
    return text


@pytest.fixture
def read(tmp_path):
    """Function that reads a recipe of a text."""
    path = tmp_path / "recipe.toml"

    def of(text):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return recipe.read(path)

    return of


@pytest.fixture(scope="module")
def schema():
    return json.loads((RECIPES / "recipe.schema.json").read_text(encoding="utf-8"))


def test_the_least_recipe_is_read_and_the_rest_has_its_defaults(read):
    least = read(MINIMAL)
    assert (least.name, least.source.metres_per_unit, least.motion.frames) == ("tiny", 0.01, 20)
    assert least.controls[0].unit == "m/s"
    assert (least.kriging.covariance, least.kriging.drift, least.kriging.nugget) == (
        "chosen",
        "chosen",
        None,
    )
    assert (least.alignment.knots, least.size.ranks, least.source.root_offset) == (6, None, None)


# What is changed in the least recipe, and what the message must hold: the key, what was found
# there, and what was expected.
FAULTS = {
    "unknown key": ("frames = 20", "frames = 20\nframez = 3", ["motion.framez", "not permitted"]),
    "missing unit of a control": ('unit = "m/s"\n', "", ["controls.0.unit", "required"]),
    "third up axis": ('up = "y"', 'up = "x"', ["source.up", "'y' or 'z'", "'x'"]),
    "ranks and a budget": (
        "rms_budget_cm = 1.0",
        "rms_budget_cm = 1.0\nranks = [3, 3, 3]",
        ["size", "found ['ranks', 'rms_budget_cm']", "either ranks or budgets"],
    ),
    "an event at no landmark": (
        "[size]",
        '[event]\njoint = "hand"\nat = "hit"\n[size]',
        ["event.at: found 'hit'", "'farthest' or a column of clips.landmarks []"],
    ),
    "control named twice": ("[motion]", f"{SECOND}[motion]", ["controls", "twice", "'speed'"]),
    "name with a blank": ('"tiny"', '"tiny one"', ["name", "pattern", "'tiny one'"]),
    "another version": ("schema = 1", "schema = 2", ["schema", "should be 1", "found 2"]),
    "unknown label": (
        "[size]",
        '[kriging]\nlabel = "mood"\n[size]',
        ["kriging.label", "found 'mood'", "expected 'performer' or a name of clips.labels"],
    ),
}


@pytest.mark.parametrize(("old", "new", "said"), FAULTS.values(), ids=FAULTS)
def test_a_fault_is_named_with_its_key_and_what_was_expected(read, tmp_path, old, new, said):
    assert MINIMAL.count(old) == 1
    with pytest.raises(RecipeError) as caught:
        read(MINIMAL.replace(old, new))
    assert caught.value.path == str(tmp_path / "recipe.toml")
    for part in said:
        assert part in caught.value.message


def test_a_label_needs_the_column_that_says_who_moved(read):
    labelled = MINIMAL + '[kriging]\nlabel = "performer"\n'
    with pytest.raises(RecipeError, match=r"kriging\.label: found 'performer', but clips"):
        read(labelled)
    told = labelled.replace('file = "file"', 'file = "file"\nperformer = "who"')
    assert read(told).kriging.label == ["performer"]
    assert read(MINIMAL).kriging.label == []


LABELLED = MINIMAL.replace(
    'file = "file"', 'file = "file"\nperformer = "who"\nlabels = { style = "manner" }'
)


def test_the_former_key_of_recordings_is_read_with_a_note(read):
    text = TOML.replace("[clips]\n", '[clips]\ntake = "session"\n')
    found = read(text)
    assert found.clips.recording == "session" and "clips.take is called" in found.notes[0]
    assert found.model_dump_json() == read(text.replace("take =", "recording =")).model_dump_json()
    with pytest.raises(RecipeError, match=r"clips\.take: found it beside clips\.recording"):
        read(text.replace("[clips]\n", '[clips]\nrecording = "session"\n'))


def test_label_sets_are_a_text_or_a_list(read):
    one = read(MINIMAL.replace('file = "file"', 'file = "file"\nperformer = "who"') + ONE_LABEL)
    assert one.kriging.label == ["performer"]
    both = read(LABELLED + '[kriging]\nlabel = ["performer", "style"]\n')
    assert both.kriging.label == ["performer", "style"]
    assert both.clips.labels == {"style": "manner"}
    assert read(LABELLED + '[kriging]\nlabel = "style"\n').kriging.label == ["style"]


ONE_LABEL = '[kriging]\nlabel = "performer"\n'


@pytest.mark.parametrize(
    ("kriging", "said"),
    [
        ('label = ["performer", "stile"]', "kriging.label: found 'stile' (did you mean 'style'?)"),
        ('label = ["style", "style"]', "expected each label set once"),
        ('label = "performer"', "clips.labels.style: found 'style', which kriging.label does not"),
    ],
)
def test_label_sets_that_do_not_fit_are_refused(read, kriging, said):
    with pytest.raises(RecipeError, match=re.escape(said)):
        read(f"{LABELLED}[kriging]\n{kriging}\n")


@pytest.mark.parametrize(
    ("roles", "said"),
    [
        ('tail = "Tail"', r"roles\.tail.*'hips', 'spine'.*found 'tail'"),
        ('hips = ""', r"roles\.hips: .*at least 1 character"),
        ("hips = 7", r"roles\.hips: .*valid string, found 7"),
        ('neck = "Neck"\nhead = "Neck"', r"joints with two roles: \['Neck'\], expected one each"),
    ],
)
def test_a_role_that_is_none_and_a_joint_with_two_are_refused(read, roles, said):
    with pytest.raises(RecipeError, match=said):
        read(MINIMAL.replace("[size]", f"[roles]\n{roles}\n[size]"))


@pytest.mark.parametrize(
    ("size", "budgets"),
    [
        ("rms_budget_cm = 1.0", {"rms": 0.01}),
        ("rms_budget_cm = 1.0\neffector_budget_cm = 2.0", {"rms": 0.01, "effector": 0.02}),
        ("ranks = [3, 4, 5]", {}),
    ],
)
def test_budgets_are_read_in_metres_in_any_combination(read, size, budgets):
    event = '[event]\njoint = "hand"\nat = "end"\n[size]'
    own = read(MINIMAL.replace("rms_budget_cm = 1.0", size).replace("[size]", event))
    assert own.size.budgets == pytest.approx(budgets)
    assert (own.size.cost, own.event.joint) == ("numbers", "hand")


def test_an_event_may_be_at_a_landmark(read):
    marked = MINIMAL.replace('file = "file"', 'file = "file"\nlandmarks = ["touch", "hit"]')
    event = '[event]\njoint = "hand"\nat = "{}"\n[size]'
    assert read(marked.replace("[size]", event.format("hit"))).event.at == "hit"
    with pytest.raises(RecipeError, match=r"found 'hat', .*clips.landmarks \['touch', 'hit'\]"):
        read(marked.replace("[size]", event.format("hat")))


def test_every_reserved_name_is_refused_and_a_free_one_is_not(read):
    for name in control_sources.RESERVED:
        with pytest.raises(RecipeError, match=f"controls.0.name.*'{name}'"):
            read(MINIMAL.replace('"speed"', f'"{name}"'))
    assert read(MINIMAL.replace('"speed"', '"pace"')).controls[0].name == "pace"


def test_bad_toml_is_refused_with_its_line(read, tmp_path):
    with pytest.raises(RecipeError, match="not TOML") as caught:
        read(MINIMAL.replace("[source]", "[source"))
    assert caught.value.line == 5
    assert str(caught.value).startswith(f"{tmp_path / 'recipe.toml'}:5: not TOML")


def test_text_that_is_not_utf_8_is_refused(read):
    with pytest.raises(RecipeError, match="not UTF-8 text"):
        read(MINIMAL.replace("Small", "Kleine für").encode("latin-1"))
    assert read(MINIMAL.replace("Small", "Kleine für")).description == "Kleine für motions"


DEEP = "tables or arrays nested too deep, expected at most five levels"


@pytest.mark.parametrize(
    "text",
    ["a = " + "[" * 100_000, ".".join("a" * 60_000) + " = 1", "[" + ".".join("a" * 200) + "]"],
    ids=["open arrays", "many dots", "table names"],
)
def test_nesting_is_bounded(read, tmp_path, text):
    with pytest.raises(RecipeError) as caught:
        read(text)
    assert str(caught.value) == f"{tmp_path / 'recipe.toml'}: {DEEP}"
    # Negative control: a recipe is nested itself, and says what is wrong with a level less.
    with pytest.raises(RecipeError, match=r"a: Extra inputs are not permitted, found \[\[") as one:
        read(MINIMAL.replace("[source]", f"a = {'[' * 15}{']' * 15}\n[source]", 1))
    assert len(one.value.message) < 400


def test_a_number_of_thousands_of_digits_is_refused(read):
    with pytest.raises(RecipeError, match="not TOML: Exceeds the limit"):
        read(MINIMAL.replace("frames = 20", f"frames = {'9' * 5_000}"))


def test_the_size_of_a_recipe_is_bounded(read, tmp_path):
    filled = MINIMAL + "#" * (recipe.MAX_BYTES - len(MINIMAL))
    assert read(filled).name == "tiny"
    with pytest.raises(RecipeError) as caught:
        read(filled + "#")
    expected = "found more than 128 kB, expected a recipe of at most 128 kB"
    assert str(caught.value) == f"{tmp_path / 'recipe.toml'}: {expected}"
    # A file without an end is read no further.
    with pytest.raises(RecipeError, match=f"/dev/zero: {expected}"):
        recipe.read(Path("/dev/zero"))


CYCLE = ("cyclic = false", "cyclic = true")
# How a control is measured, what else is changed, and what the message must hold.
UNMEASURABLE = {
    "unknown quantity": (
        '{ quantity = "pace" }',
        [],
        ["controls.0.auto.quantity", "'left'", "'root_height'", "found 'pace'"],
    ),
    "a place without a joint": (
        '{ quantity = "height", at = "end" }',
        [],
        ["controls.0.auto", "found at besides quantity 'height', expected joint and at"],
    ),
    "a speed of a joint": (
        '{ quantity = "speed", joint = "a" }',
        [CYCLE],
        ["found joint besides quantity 'speed', expected nothing"],
    ),
    "a speed of no cycle": (
        '{ quantity = "speed" }',
        [],
        ["controls.0.auto.quantity: found 'speed' and motion.cyclic = false, expected a cycle"],
    ),
    "a step of nobody knows which feet": (
        '{ quantity = "step_length" }',
        [CYCLE],
        ["joints: found none and motion.feet [], expected two feet"],
    ),
    "another unit": (
        '{ quantity = "turn" }\nunit = "rad"',
        [CYCLE],
        ["controls.0", "unit: found 'rad', expected 'deg', in which turn is measured, or no unit"],
    ),
}


@pytest.mark.parametrize("fault", UNMEASURABLE)
def test_what_cannot_be_measured_is_refused_by_key_found_and_expected(read, fault):
    auto, changes, said = UNMEASURABLE[fault]
    with pytest.raises(RecipeError) as caught:
        read(measured(auto, changes))
    for words in said:
        assert words in str(caught.value)
    assert "(auto)" not in str(caught.value)
    assert "default factory" not in str(caught.value)


@pytest.mark.parametrize(
    ("auto", "unit"),
    [
        ('{ quantity = "left", joint = ["a", "b"], at = "farthest" }', "m"),
        ('{ quantity = "root_height", at = "lowest" }\nunit = "m"', "m"),
        ('{ quantity = "speed" }', "m/s"),
        ('{ quantity = "turn" }\nunit = "deg"', "deg"),
        ('{ quantity = "leg_length", joints = ["a", "b"] }', "m"),
    ],
)
def test_what_is_measured_knows_its_unit_and_keeps_the_schema(read, schema, auto, unit):
    changes = [
        CYCLE,
        ("file = ", 'landmarks = ["strike"]\nfile = '),
        ("[size]", 'feet = ["a", "b"]\n[size]'),
    ]
    text = measured(auto, changes)
    found = read(text)
    assert [control.unit for control in found.measured] == [unit]
    assert found.column_controls == []
    jsonschema.Draft202012Validator(schema).validate(tomllib.loads(text))


def test_the_published_schema_is_the_one_of_the_code():
    published = (RECIPES / "recipe.schema.json").read_text(encoding="utf-8")
    assert published == recipe.json_schema()
    jsonschema.Draft202012Validator.check_schema(json.loads(published))


@pytest.mark.parametrize("name", sorted(path.stem for path in RECIPES.glob("*.toml")))
def test_shipped_recipes_are_read_and_keep_the_schema(name, schema):
    path = RECIPES / f"{name}.toml"
    assert recipe.read(path).name == name
    plain = tomllib.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(plain)
    assert path.read_text(encoding="utf-8").startswith("#:schema ./recipe.schema.json\n")


# --- lines of mistakes ---

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


@pytest.mark.parametrize("text", [TRICKY, TOML, (RECIPES / "cmu_walk.toml").read_text()])
def test_keys_of_tables_that_tomllib_reads_have_a_line(text):
    """Oracle: tomllib."""
    known, wanted = set(key_lines(text)), paths(tomllib.loads(text))
    assert known <= wanted
    tables = {path for path in wanted if len(path) <= 2 and all(isinstance(p, str) for p in path)}
    assert tables <= known | {("controls",), ("fruit", "kinds")}


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


def test_a_mistake_of_our_own_checks_has_its_key_and_no_words_of_pydantic(refused):
    text = TOML.replace("[size]", '[event]\njoint = "hand"\nat = "hightest"\n[size]')
    (line,) = refused(text)
    at = line_of(text, "at = ")
    expected = (
        "found 'hightest' (did you mean 'highest'?), expected 'start', 'end', 'highest', 'lowest', "
        "'farthest' or a column of clips.landmarks []"
    )
    assert line == f"{at}: event.at: {expected}"


def test_the_number_of_listed_mistakes_is_bounded(refused):
    lines = refused("".join(f"key{number} = 1\n" for number in range(100)) + TOML)
    assert len(lines) == 21 and lines[-1] == " 80 further mistakes"
