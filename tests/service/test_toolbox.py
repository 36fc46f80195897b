"""Tests of the tools for agents: results match their schemas, errors point into the arguments."""

import json

import jsonschema
import pytest

from posefield.common.errors import FileError, InvalidField, QueryError, UnknownModel
from posefield.mcp import Toolbox
from posefield.registry import model_registry

WALKS = {
    "segments": [
        {"kind": "walk", "model": "walk", "to": [0, 2]},
        {"kind": "walk", "model": "walk", "seconds": 1, "turn": 0.3},
    ]
}


@pytest.fixture(scope="module")
def registry(models):
    return model_registry.load([models])


@pytest.fixture
def box(registry, tmp_path):
    return Toolbox(registry, tmp_path)


def called(box, name, arguments):
    """The result of a tool, after its arguments and the result have passed their schemas."""
    tool = box.tools[name]
    jsonschema.validate(arguments, tool.input_schema, jsonschema.Draft202012Validator)
    found = json.loads(json.dumps(box.call(name, arguments)))
    jsonschema.validate(found, tool.output_schema, jsonschema.Draft202012Validator)
    return found


def test_models_say_which_segment_they_can_be(box):
    found = {each["name"]: each for each in called(box, "list_models", {})["models"]}
    assert {name: each["segment"] for name, each in found.items()} == {
        "reach": "act",
        "walk": "walk",
    }
    assert "RightHand" in found["reach"]["joints"] and "performer" in found["reach"]["labels"]
    assert {"name", "unit", "minimum", "maximum", "description"} == set(
        found["walk"]["controls"][0]
    )


def test_a_file_has_the_report_of_its_plan(box, tmp_path):
    planned = called(box, "plan_performance", {"script": WALKS})
    made = called(box, "perform", {"script": WALKS, "file": "walks.usdc"})
    assert made["file"] == str(tmp_path / "walks.usdc")
    assert (tmp_path / "walks.usdc").read_bytes().startswith(b"PXR-USDC")
    assert made["segments"] == planned["segments"] and made["joins"] == planned["joins"]
    assert [each.name for each in tmp_path.iterdir()] == ["walks.usdc"]


def test_a_link_in_the_folder_is_replaced_and_leads_nowhere_else(box, tmp_path):
    secret = tmp_path / "other.txt"
    secret.write_text("kept")
    (tmp_path / "walks.npz").symlink_to(secret)
    called(box, "perform", {"script": WALKS, "file": "walks.npz"})
    assert secret.read_text() == "kept" and not (tmp_path / "walks.npz").is_symlink()


def test_only_performing_writes(box, tmp_path):
    assert [tool.name for tool in box.tools.values() if not tool.annotations.read_only_hint] == [
        "perform"
    ]
    called(box, "list_models", {})
    called(box, "plan_performance", {"script": WALKS})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "arguments", "kind", "said"),
    [
        (
            "plan",
            {},
            InvalidField,
            "no tool 'plan' (did you mean 'plan_performance'?), expected one of list_models, plan",
        ),
        (
            "plan_performance",
            {"script": {"segments": [{"kind": "hold", "seconds": 1}], "take": 10**400}},
            QueryError,
            "script/take: Expected `int` <=",
        ),
        (
            "plan_performance",
            {"script": {"segments": [*WALKS["segments"], {"kind": "act", "model": "reech"}]}},
            UnknownModel,
            "script/segments/2/model: no model 'reech' (did you mean 'reach'?)",
        ),
        (
            "perform",
            {"script": WALKS, "file": "../walks.usdc"},
            InvalidField,
            "file: '../walks.usdc', expected a name without folders",
        ),
        (
            "perform",
            {"script": WALKS, "file": "walks.usd"},
            InvalidField,
            "file: 'walks.usd' ends in none of usda, usdc,",
        ),
        (
            "perform",
            {"script": {**WALKS, "unit": "m", "up": "z"}, "file": "walks.glb"},
            QueryError,
            "script/up: ",
        ),
    ],
)
def test_errors_point_into_the_arguments(box, tmp_path, name, arguments, kind, said):
    with pytest.raises(kind) as caught:
        box.call(name, arguments)
    assert str(caught.value).startswith(said)
    assert list(tmp_path.iterdir()) == []


def test_performing_has_the_errors_of_a_plan(box):
    wrong = {"segments": [*WALKS["segments"], {"kind": "act", "model": "reech"}]}
    told = []
    for name, more in (("plan_performance", {}), ("perform", {"file": "a.usdc"})):
        with pytest.raises(UnknownModel) as caught:
            box.call(name, {"script": wrong, **more})
        told.append(str(caught.value))
    assert told[0] == told[1]


def test_a_folder_that_cannot_be_written_is_named(registry, tmp_path):
    (tmp_path / "taken").touch()
    box = Toolbox(registry, tmp_path / "taken")
    with pytest.raises(FileError) as caught:
        box.call("perform", {"script": WALKS, "file": "walks.usdc"})
    assert "taken" in str(caught.value)
