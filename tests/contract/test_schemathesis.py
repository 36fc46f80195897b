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
    for name in ("to", "turn", "seconds", "facing"):
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
        f"{event.phase.value} {event.label}: {check.failure_info.failure}\n{call.request.uri} "
        f"{call.request.body} {call.response and call.response.content[-500:]}"
        for case, checks in event.recorder.checks.items()
        for call in [event.recorder.interactions[case]]
        for check in checks
        if check.status == Status.FAILURE
    ]


def narrowed(spec, card):
    """The contract of models, poses, clips and reasons with what only this model's card says: its
    controls, times and performers. Which lists are equally long, which names and axes differ and
    which segments follow one another no schema can say: such questions are left out."""
    narrow = copy.deepcopy(spec)
    for path in [*narrow["paths"]]:
        if path.split("/")[-1].partition(".")[0] in (
            "crowd",
            "tracks",
            "clips",
            "sigma",
            "batch",
        ) or ("performances" in path):
            del narrow["paths"][path]
    schemas, parameters = (narrow["components"][part] for part in ("schemas", "parameters"))
    # Reference motions are of models of robots.
    parameters["clipEnding"] = parameters["clipFormat"]
    clip = schemas["ClipQuestion"]["properties"]

    def only(name, schema, *names):
        """Narrow a parameter, a field of clips, and schemas."""
        parameters[name]["schema"] = schema
        if name in clip:
            clip[name] = schema
        schemas.update(dict.fromkeys(names, schema))

    def between(low, high, kind="number"):
        return {"type": kind, "minimum": low, "maximum": high}

    numbers = {c.name: between(c.minimum, c.maximum) for c in card.controls}
    exact = {"type": "object", "properties": numbers, "required": [*numbers]}
    only("controls", {**exact, "additionalProperties": False}, "Controls")
    only("model", {"enum": ["reach"]})
    for name, ends in {"start": (0, 0.2), "end": (0.3, 0.8), "fps": (1, 240)}.items():
        only(name, between(*ends))
    # This model's last pose leads nowhere, and one schema serves all formats, glTF too.
    schemas["Loop"] = {"type": "boolean", "enum": [False]}
    for name, value in (("unit", "m"), ("up", "y")):
        only(name, {"enum": [value]})
    # Nor can it say which formats have a body, and the service has no characters of users.
    for name in ("body", "character"):
        del clip[name]
        for path in ("clip", "clip.{format}"):
            given = narrow["paths"][f"/v1/models/{{model}}/{path}"]["get"]["parameters"]
            given[:] = [each for each in given if not each.get("$ref", "").endswith(f"/{name}")]
    # Feet of this model are as predicted, so that they stand on no floor but the level one.
    only("floor", {"enum": ["0"]})
    schemas["FloorValue"] = clip["floor"] = {"enum": [0.0]}
    only("feet", {"enum": ["as_predicted"]}, "FeetMode")
    times = between(0, 0.8)
    parameters["time"]["schema"]["items"] = times
    schemas["PoseQuestion"]["properties"]["times"]["items"] = times
    only("level", between(0, len(card.levels) - 1, "integer"), "LevelNumber")
    for name in ("performer", "whose"):
        only(name, {"enum": [*card.performers]}, "Performer")
    # No schema can say that a performer is given in one of two ways.
    for name in ("label", "whoseLabel"):
        only(name, {"type": "array", "maxItems": 0})
    schemas["Labels"] = {"type": "object", "additionalProperties": False}
    # None of its controls is measured, and which places are out of reach no schema can say.
    only("exact", {"enum": ["auto", "none"]}, "Exact")
    schemas["Extrapolate"] = {"enum": ["warn"]}
    target = schemas["Target"]["properties"]
    target |= {"joint": {"enum": list(card.skeleton.names)}, "time": times}
    schemas["Targets"]["maxItems"] = 1
    words = [f"{card.skeleton.names[-1]}@{when}:0.3,1.2,-0.4" for when in ("event", "0.5", "end")]
    parameters["target"]["schema"] = {"type": "array", "maxItems": 1, "items": {"enum": words}}
    for parameter in parameters.values():
        parameter.pop("example", None)
    return narrow
