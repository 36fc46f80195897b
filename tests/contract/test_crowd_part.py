"""The contract's part on crowds, before it is merged: sound, and true of decoder and encoder."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import openapi_spec_validator
import orjson
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.encode import CROWD_ENCODERS
from service.motion.crowd import CrowdPoses
from service.motion.errors import InvalidField
from service.motion.skeleton import Skeleton
from service.web import crowd_query
from service.web.problems import RequestFault

API = Path(__file__).parents[2] / "api"
EXAMPLES = API / "crowd.part.examples"
NAMES = ("queryCrowdArrow", "queryCrowdNpz", "queryCrowdJson")


@pytest.fixture(scope="module")
def whole(spec):
    """The contract with the part in it."""
    part = yaml.safe_load((API / "crowd.part.yaml").read_bytes())
    kinds = spec["components"].keys() | part["components"].keys()
    both = {k: spec["components"].get(k, {}) | part["components"].get(k, {}) for k in kinds}
    return {**spec, "paths": spec["paths"] | part["paths"], "components": both}


def checker(whole, name):
    schema = {**whole["components"]["schemas"][name], "components": whole["components"]}
    return jsonschema.Draft202012Validator(schema)


def test_with_the_part_the_contract_is_valid_and_loses_nothing(spec, whole):
    openapi_spec_validator.validate(whole)
    assert whole["paths"].keys() > spec["paths"].keys()
    for kind, known in spec["components"].items():
        part = yaml.safe_load((API / "crowd.part.yaml").read_bytes())["components"].get(kind, {})
        assert not known.keys() & part.keys(), kind


@pytest.mark.parametrize("extension", CROWD_ENCODERS)
def test_each_format_has_a_path_and_the_media_type_of_its_encoder(whole, extension):
    asked = whole["paths"][f"/v1/models/{{model}}/crowd.{extension}"]["post"]
    answer = whole["components"]["responses"][asked["responses"]["200"]["$ref"].split("/")[-1]]
    assert list(answer["content"]) == [CROWD_ENCODERS[extension].media_type]
    assert asked["operationId"] == f"queryCrowd{extension.capitalize()}"


@pytest.mark.parametrize("name", NAMES)
def test_the_example_is_a_question(whole, name):
    body = json.loads((EXAMPLES / name / "request.json").read_bytes())["body"]
    checker(whole, "CrowdQuestion").validate(body)
    assert len(crowd_query.of_body(json.dumps(body).encode(), 100)) == 2


def test_what_json_holds_matches_the_schema(whole):
    ones = np.ones(2, np.float32)
    skeleton = Skeleton(("hips",), (-1,), np.zeros((1, 3)), (), np.zeros((0, 3)))
    turns, points = np.ones((2, 1, 4), np.float32), np.zeros((2, 3), np.float32)
    poses = CrowdPoses(
        "walk@0123456789abcdef",
        skeleton,
        turns,
        points,
        points[:, None],
        np.array([0, 3]),
        ones,
        ones,
        ones,
        ("it is slow",),
    )
    content = orjson.loads(CROWD_ENCODERS["json"].encode(poses))
    schema = checker(whole, "CrowdPoses")
    schema.validate(content)
    assert content.keys() == schema.schema["properties"].keys()
    assert not schema.is_valid(content | {"levels": [0, 3.5]})


NUMBERS = st.sampled_from([0, 1.5, -2, 1e-7, 3.2, 2e6, 1e300])
WRONG = st.sampled_from([None, True, "auto", "x", "", {}, [], [[]], [None], ["x"], [1], [1, 2.5]])
VALUES = st.one_of(
    NUMBERS,
    WRONG,
    st.lists(NUMBERS, max_size=4),
    st.lists(st.lists(NUMBERS, min_size=2, max_size=4), max_size=3),
    st.fixed_dictionaries({"position": st.just([0, 0, 0]), "fov": NUMBERS, "height": NUMBERS}),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=500)
@given(data=st.data())
def test_what_breaks_the_schema_is_refused_and_nothing_else_is_a_bad_body(whole, data):
    schema = checker(whole, "CrowdQuestion")
    fields = [*schema.schema["properties"], "times"]
    body = {"controls": {"speed": 1}, "time": 0} | data.draw(
        st.dictionaries(st.sampled_from(fields), VALUES, max_size=3)
    )
    try:
        crowd_query.of_body(json.dumps(body).encode(), 100)
    except RequestFault:
        assert not schema.is_valid(body)
    except InvalidField:
        pass
    else:
        schema.validate(body)
