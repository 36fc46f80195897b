"""Requests drawn from the contract, right ones and wrong ones: every answer keeps the contract."""

import copy
from collections import Counter

import schemathesis
from schemathesis.config import (
    ChecksConfig,
    GenerationConfig,
    ProjectConfig,
    ProjectsConfig,
    StatefulPhaseConfig,
)
from schemathesis.config import PositiveDataAcceptanceConfig as Acceptance
from schemathesis.engine import Status, events, from_schema
from schemathesis.generation import GenerationMode

from service.synthesis.library import Library
from service.web.app import create_app
from service.web.settings import Settings

PHASES = ("examples", "coverage", "fuzzing", "stateful")
SEED = 1


def test_every_answer_keeps_the_contract(spec, app):
    # The contract cannot know a model's controls: a request that keeps it may still get 422.
    accepted = Acceptance(expected_statuses=["2xx", "304", "404", "422"])
    aimed = copy.deepcopy(spec)
    # A drawn name would meet 404 before anything else of the request is looked at.
    aimed["components"]["parameters"]["model"]["schema"] = {"enum": ["reach", "nobody"]}
    without_bytes(aimed)
    with_few_tags(aimed)
    found, calls = run(aimed, app, accepted, list(GenerationMode), examples=40)
    assert found == []
    assert enough(calls, 1500)


def test_every_right_question_to_this_model_is_answered(spec, loaded):
    reach = loaded.find("reach")
    own = reach.session
    # Links from the list of models lead to all that are in it.
    alone = create_app(Library({"reach": reach}), Settings())
    narrow = narrowed(spec, own.card, own.digest)
    with_few_tags(narrow)
    accepted = Acceptance(expected_statuses=["2xx", "304"])
    found, calls = run(narrow, alone, accepted, [GenerationMode.POSITIVE], examples=40)
    assert found == []
    assert enough(calls, 700)


def test_a_contract_that_the_service_breaks_is_found_out(spec, app):
    broken = copy.deepcopy({**spec, "paths": {"/livez": spec["paths"]["/livez"]}})
    broken["components"]["schemas"]["Liveness"]["properties"]["status"]["const"] = "dead"
    found, _ = run(broken, app, Acceptance(enabled=False), list(GenerationMode), examples=1)
    assert any("Response violates schema" in line for line in found)


def enough(calls, least):
    """Whether so many requests were sent, and some in each phase."""
    return calls.total() > least and all(calls[name] for name in PHASES)


def without_bytes(spec):
    """Take out of inference what no schema can say: how bytes follow JSON in a body."""
    del spec["components"]["requestBodies"]["InferenceQuestion"]["content"][
        "application/octet-stream"
    ]
    for path in (path for path in spec["paths"] if path.endswith("/infer")):
        del spec["paths"][path]["post"]["parameters"]


def with_few_tags(spec):
    """Take If-None-Match out of all operations but one, as it is looked at before any of them."""
    tags = {"$ref": "#/components/parameters/ifNoneMatch"}
    for path in spec["paths"].keys() - {"/v1/models/{model}"}:
        asked = spec["paths"][path].get("get", {}).get("parameters", [])
        if tags in asked:
            asked.remove(tags)


def run(spec, app, accepted, modes, examples):
    """Failures that the phases find, one line each, and how many requests each sent."""
    generation = GenerationConfig(modes=modes, max_examples=examples, deterministic=True)
    checks = ChecksConfig(positive_data_acceptance=accepted)
    # A list that is too long may be a body that is too long.
    checks.negative_data_rejection.expected_statuses.append("413")
    project = ProjectConfig(generation=generation, checks=checks, continue_on_failure=True)
    project.phases.update(phases=list(PHASES))
    fewer = GenerationConfig(modes=modes, max_examples=max(1, examples // 8), deterministic=True)
    project.phases.stateful = StatefulPhaseConfig(generation=fewer, max_steps=4)
    project.phases.coverage.generate_duplicate_query_parameters = True
    config = schemathesis.Config(seed=SEED, projects=ProjectsConfig(default=project))
    schema = schemathesis.openapi.from_dict(copy.deepcopy(spec), config=config)
    schema.app = app
    found, calls = [], Counter()
    for event in from_schema(schema).execute():
        if isinstance(event, events.NonFatalError | events.FatalError):
            found.append(str(event))
        if isinstance(event, events.ScenarioFinished):
            calls[event.phase.value] += len(event.recorder.interactions)
            found += failures(event)
    return found, calls


def failures(event):
    return [
        f"{event.phase.value} {event.label} {case}: {check.failure_info.failure}"
        for case, checks in event.recorder.checks.items()
        for check in checks
        if check.status == Status.FAILURE
    ]


def narrowed(spec, card, digest):
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
    # Nor that tensors fit each other.
    narrow["paths"] = {
        path: item
        for path, item in narrow["paths"].items()
        if not ("crowd" in path and "get" in item) and not path.endswith("/infer")
    }
    # That a grid's axes differ, and are not among what is fixed, cannot be said either.
    axes = {"across": {"enum": [card.controls[0].name]}, "along": {"enum": [card.controls[1].name]}}
    others = {control.name: numbers[control.name] for control in card.controls[2:]}
    fixed = {"type": "object", "properties": others, "additionalProperties": False}
    parts["schemas"]["SigmaQuestion"]["properties"] |= {**axes, "controls": fixed}
    for name, only in axes.items():
        parts["parameters"][name]["schema"] = only
    parts["parameters"]["fixedControls"]["schema"] = fixed
    parts["schemas"]["GridSteps"]["maximum"] = 100
    parts["parameters"]["version"]["schema"] = {"enum": [digest]}
    parts["parameters"]["level"]["schema"] = parts["schemas"]["LevelNumber"] = level
    performers = list(card.performers)
    for name in ("performer", "whose"):
        parts["parameters"][name]["schema"] = {"enum": performers}
    parts["schemas"]["Performer"] = {"enum": [*performers, None]}
    for parameter in parts["parameters"].values():
        parameter.pop("example", None)
    return narrow


def narrow_holds(parts, card, times):
    """What this model can be held to: no control of it is measured, it has no feet to pin, and
    which places are out of reach, or that two targets differ, cannot be said in a schema."""
    parts["schemas"]["PinFeet"] = {"type": "boolean", "enum": [False]}
    parts["schemas"]["Exact"] = parts["parameters"]["exact"]["schema"] = {"enum": ["auto", "none"]}
    parts["schemas"]["Extrapolate"] = {"enum": ["warn"]}
    target = parts["schemas"]["Target"]["properties"]
    target |= {"joint": {"enum": list(card.skeleton.names)}, "time": times}
    parts["schemas"]["Targets"]["maxItems"] = 1
    words = [f"{card.skeleton.names[-1]}@{when}:0.3,1.2,-0.4" for when in ("event", "0.5", "end")]
    listed = {"type": "array", "maxItems": 1, "items": {"enum": words}}
    parts["parameters"]["target"]["schema"] = listed
