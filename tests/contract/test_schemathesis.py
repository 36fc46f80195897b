"""Fuzzing with requests drawn from the contract, valid and invalid, by Schemathesis."""

import copy
import os
from collections import Counter
from urllib.parse import urlsplit

import pytest
import schemathesis
import yaml
from schemathesis.config import (
    ChecksConfig,
    GenerationConfig,
    InferenceAlgorithm,
    ProjectConfig,
    ProjectsConfig,
    StatefulPhaseConfig,
)
from schemathesis.config import PositiveDataAcceptanceConfig as Acceptance
from schemathesis.engine import Status, events, from_schema
from schemathesis.generation import GenerationMode

from posefield.http.api import contract
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry

# `make fuzz` draws for longer, from another seed.
SEED = int(os.environ.get("POSEFIELD_FUZZ_SEED", "1"))
DETERMINISTIC = "POSEFIELD_FUZZ_SEED" not in os.environ
SECONDS = int(os.environ.get("POSEFIELD_FUZZ_SECONDS", "15"))
"""Budget of each of the two runs that draw requests, s."""

HOST = "testserver"
# The phases of a run, and how many requests each of them sends at least.
EXAMPLES = {"examples": 20}
LISTED = {"examples": 20, "coverage": 500}
DRAWN = {"fuzzing": 10, "stateful": 1}
RINGS = pytest.mark.parametrize(
    "phases",
    [
        pytest.param(EXAMPLES, id="examples"),
        pytest.param(LISTED, id="listed", marks=pytest.mark.system),
        pytest.param(DRAWN, id="drawn", marks=pytest.mark.system),
    ],
)


@pytest.fixture(scope="module")
def app(loaded):
    """The service under the name that schemathesis asks for in its own process."""
    return create_app(loaded, Settings(hosts=HOST))


@RINGS
def test_every_answer_keeps_the_contract(spec, app, phases):
    # The contract cannot know a model's controls: a request that keeps it may still get 422.
    # A list that is right may still be too long for a URL.
    accepted = Acceptance(expected_statuses=["2xx", "304", "404", "414", "422"])
    aimed = copy.deepcopy(spec)
    # A drawn name would meet 404 before anything else of the request is looked at.
    aimed["components"]["parameters"]["model"]["schema"] = {"enum": ["reach", "nobody"]}
    with_few_tags(aimed)
    with_one_way(aimed)
    with_one_label(aimed)
    with_crowds_apart(aimed)
    found, calls, asked = run(aimed, app, accepted, list(GenerationMode), phases)
    assert found == []
    assert_enough(calls, phases)
    if phases is LISTED:
        assert {(method, path) for method, path, _ in asked} >= formats(spec)


@RINGS
def test_every_right_question_to_this_model_is_answered(spec, loaded, phases):
    reach = loaded.find("reach")
    own = reach.session
    # Links from the list of models lead to all that are in it.
    alone = create_app(ModelRegistry({"reach": reach}), Settings(hosts=HOST))
    narrow = narrowed(spec, own.card)
    with_few_tags(narrow)
    accepted = Acceptance(expected_statuses=["2xx", "304", "414"])
    found, calls, asked = run(narrow, alone, accepted, [GenerationMode.POSITIVE], phases)
    assert found == []
    assert_enough(calls, phases)
    if phases is LISTED:
        answered = {(method, path) for method, path, status in asked if status == 200}
        assert answered >= formats(narrow)


def test_a_contract_that_the_service_breaks_is_found_out(spec, app):
    broken = copy.deepcopy({**spec, "paths": {"/livez": spec["paths"]["/livez"]}})
    broken["components"]["schemas"]["Liveness"]["properties"]["status"]["const"] = "dead"
    every = Acceptance(enabled=False)
    found, _, _ = run(broken, app, every, list(GenerationMode), LISTED)
    assert any("Response violates schema" in line for line in found)


def assert_enough(calls, phases):
    """Every phase has sent requests, and no other than those asked for."""
    assert calls.keys() == phases.keys()
    assert all(calls[phase] >= least for phase, least in phases.items()), calls


def formats(spec):
    """Method and path of each format that ends a path of the contract, for the model reach."""
    operations = contract.parse_contract(yaml.safe_dump(spec, sort_keys=False).encode()).operations
    return {
        (each.method, each.path.format(model="reach", format=form))
        for each in operations
        for form in each.formats
    }


def with_few_tags(spec):
    """Take If-None-Match out of all operations but one, as it is looked at before any of them."""
    tags = {"$ref": "#/components/parameters/ifNoneMatch"}
    for path in spec["paths"].keys() - {"/v1/models/{model}"}:
        asked = spec["paths"][path].get("get", {}).get("parameters", [])
        if tags in asked:
            asked.remove(tags)


def with_one_label(spec):
    """Ask for one name at most: a schema cannot say that a label set or a name is given once."""
    for parameter in spec["components"]["parameters"].values():
        if parameter["name"] == "label":
            items = {"type": "string", "pattern": "^[^=]+=[^,:]+$"}
            parameter["schema"] = {"type": "array", "items": items, "maxItems": 1}


def with_one_way(spec):
    """Leave walks one way to end, performances one way to begin, targets one moment, and no plan
    in the format of a file: no schema here says that fields exclude each other."""
    parts = spec["components"]
    for name in ("to", "turn", "seconds"):
        del parts["schemas"]["Walk"]["properties"][name]
    del parts["schemas"]["PerformanceStart"]["properties"]["poses"]
    spec["components"]["parameters"]["plan"]["schema"] = {"enum": [False]}
    target = parts["schemas"]["PlacedTarget"]
    del target["properties"]["time"]
    target["required"] = ["joint", "position", "at"]


def with_crowds_apart(spec):
    """Move the crowd that walks to a path of its own. Its formats are others than those of crowd
    poses, so that no address takes both methods; schemathesis expects Allow to name both."""
    paths, path = spec["paths"], "/v1/models/{model}/crowd.{format}"
    walk = paths[path].pop("get")
    form = {"$ref": "#/components/parameters/walkFormat"}
    walk["parameters"].remove(form)
    own = {**spec["components"]["parameters"]["walkFormat"], "name": "form"}
    given = [*paths[path]["parameters"], own]
    paths[path.replace("{format}", "{form}")] = {"parameters": given, "get": walk}


def run(spec, app, accepted, modes, phases):
    """Failures that the phases find, one line each, requests of each phase, and method, path and
    status of the requests."""
    # The budget ends a run that draws, however many examples are left.
    examples = 40 * max(1, SECONDS // 30)
    generation = GenerationConfig(modes=modes, max_examples=examples, deterministic=DETERMINISTIC)
    checks = ChecksConfig(positive_data_acceptance=accepted)
    # A list that is too long may be a body that is too long.
    checks.negative_data_rejection.expected_statuses += ["413", "414"]
    project = ProjectConfig(generation=generation, checks=checks, continue_on_failure=True)
    fewer = GenerationConfig(modes=modes, max_examples=examples // 8, deterministic=DETERMINISTIC)
    project.phases.stateful = StatefulPhaseConfig(generation=fewer, max_steps=4)
    # It takes one operation's format for another's, as both parameters have one name.
    project.phases.stateful.inference.algorithms.remove(InferenceAlgorithm.DEPENDENCY_ANALYSIS)
    project.phases.update(phases=list(phases))
    project.phases.coverage.generate_duplicate_query_parameters = True
    config = schemathesis.Config(
        seed=SEED,
        max_time=SECONDS if phases is DRAWN else None,
        projects=ProjectsConfig(default=project),
    )
    schema = schemathesis.openapi.from_dict(copy.deepcopy(spec), config=config)
    schema.app = app
    found, calls, asked = [], Counter(), set()
    for event in from_schema(schema).execute():
        if isinstance(event, events.NonFatalError | events.FatalError):
            found.append(str(event))
        if isinstance(event, events.ScenarioFinished):
            calls[event.phase.value] += len(event.recorder.interactions)
            asked |= {
                (each.request.method, urlsplit(each.request.uri).path, each.response.status_code)
                for each in event.recorder.interactions.values()
                if each.response is not None
            }
            found += failures(event)
    return found, calls, asked


def failures(event):
    return [
        f"{event.phase.value} {event.label} {case}: {check.failure_info.failure}"
        for case, checks in event.recorder.checks.items()
        for check in checks
        if check.status == Status.FAILURE
    ]


def narrowed(spec, card):
    """The contract with what only this model's card says: its controls, times and performers."""
    narrow = copy.deepcopy(spec)
    parts = narrow["components"]
    numbers = {
        c.name: {"type": "number", "minimum": c.minimum, "maximum": c.maximum}
        for c in card.controls
    }
    exact = {
        "type": "object",
        "properties": numbers,
        "required": list(numbers),
        "additionalProperties": False,
    }
    parts["schemas"]["Controls"] = exact
    parts["parameters"]["controls"]["schema"] = exact
    parts["parameters"]["model"]["schema"] = {"enum": ["reach"]}
    bounds = {"start": (0, 0.2), "end": (0.3, 0.8), "fps": (1, 240)}
    for name, (low, high) in bounds.items():
        between = {"type": "number", "minimum": low, "maximum": high}
        parts["parameters"][name]["schema"] = between
        for question in ("ClipQuestion", "NamedClipQuestion"):
            parts["schemas"][question]["properties"][name] = between
    # This model's last pose leads nowhere, and one schema serves all formats, glTF too.
    parts["schemas"]["Loop"] = {"type": "boolean", "enum": [False]}
    for name, only in (("unit", "m"), ("up", "y")):
        for question in ("ClipQuestion", "ClipsQuestion"):
            parts["schemas"][question]["properties"][name] = {"enum": [only, None]}
    # Nor can it say which formats have a body, and the service has no characters of users.
    for question in ("ClipQuestion", "ClipsQuestion"):
        for name in ("body", "character"):
            del parts["schemas"][question]["properties"][name]
    # Feet of this model are as predicted, so that they stand on no floor but the level one.
    parts["schemas"]["FloorValue"] = {"enum": [0.0]}
    parts["parameters"]["floor"]["schema"] = {"enum": ["0"]}
    # That names differ cannot be said in a schema.
    del parts["schemas"]["NamedClipQuestion"]["properties"]["name"]
    parts["schemas"]["ClipsQuestion"]["properties"]["clips"]["maxItems"] = 3
    times = {"type": "number", "minimum": 0, "maximum": 0.8}
    parts["parameters"]["time"]["schema"]["items"] = times
    parts["schemas"]["PoseQuestion"]["properties"]["times"]["items"] = times
    # That all lists are equally long cannot be said in a schema, nor that this model does not walk.
    crowd = parts["schemas"]["CrowdQuestion"]
    level = {"type": "integer", "minimum": 0, "maximum": len(card.levels) - 1}
    crowd["properties"] = {"controls": exact, "time": times, "level": level}
    narrow_holds(parts, card, times)
    for path in ("crowd", "crowd.{format}"):
        del narrow["paths"][f"/v1/models/{{model}}/{path}"]["get"]
    # One schema serves all formats, glTF too.
    given = narrow["paths"]["/v1/models/{model}/clip.{format}"]["get"]["parameters"]
    given.remove({"$ref": "#/components/parameters/body"})
    for path in ("clip", "clip.{format}"):
        whole = narrow["paths"][f"/v1/models/{{model}}/{path}"]["get"]["parameters"]
        whole.remove({"$ref": "#/components/parameters/character"})
    for name, only in (("unit", "m"), ("up", "y")):
        given.remove({"$ref": f"#/components/parameters/{name}"})
        given.append({"name": name, "in": "query", "schema": {"enum": [only]}})
    # That a grid's axes differ, and are not among what is fixed, cannot be said either.
    axes = {"across": {"enum": [card.controls[0].name]}, "along": {"enum": [card.controls[1].name]}}
    others = {control.name: numbers[control.name] for control in card.controls[2:]}
    fixed = {"type": "object", "properties": others, "additionalProperties": False}
    parts["schemas"]["SigmaQuestion"]["properties"] |= {**axes, "controls": fixed}
    for name, only in axes.items():
        parts["parameters"][name]["schema"] = only
    parts["parameters"]["fixedControls"]["schema"] = fixed
    parts["schemas"]["GridSteps"]["maximum"] = 100
    parts["parameters"]["level"]["schema"] = parts["schemas"]["LevelNumber"] = level
    performers = list(card.performers)
    for name in ("performer", "whose"):
        parts["parameters"][name]["schema"] = {"enum": performers}
    parts["schemas"]["Performer"] = {"enum": [*performers, None]}
    # No schema can say that a performer is given in one of two ways.
    for name in ("label", "whoseLabel"):
        parts["parameters"][name]["schema"] = {"type": "array", "maxItems": 0}
    parts["schemas"]["Labels"] = {"type": "object", "additionalProperties": False}
    # Which segments follow one another, and which fields exclude each other, no schema can say.
    endings = ("", ".{format}", "/batch", "/batch.{format}")
    for path in (f"performances{ending}" for ending in endings):
        del narrow["paths"][f"/v1/{path}"]
    crowd = parts["schemas"]["CrowdQuestion"]["properties"]
    crowd["labels"] = {"type": "object", "additionalProperties": False}
    for parameter in parts["parameters"].values():
        parameter.pop("example", None)
    return narrow


def narrow_holds(parts, card, times):
    """Narrow the constraints to this model's: none of its controls is measured, it has no feet
    that stand, and no schema can say which places are out of reach, or that two targets differ."""
    parts["schemas"]["FeetMode"] = parts["parameters"]["feet"]["schema"] = {
        "enum": ["as_predicted"]
    }
    parts["schemas"]["Exact"] = parts["parameters"]["exact"]["schema"] = {"enum": ["auto", "none"]}
    parts["schemas"]["Extrapolate"] = {"enum": ["warn"]}
    target = parts["schemas"]["Target"]["properties"]
    target |= {"joint": {"enum": list(card.skeleton.names)}, "time": times}
    parts["schemas"]["Targets"]["maxItems"] = 1
    words = [f"{card.skeleton.names[-1]}@{when}:0.3,1.2,-0.4" for when in ("event", "0.5", "end")]
    listed = {"type": "array", "maxItems": 1, "items": {"enum": words}}
    parts["parameters"]["target"]["schema"] = listed
