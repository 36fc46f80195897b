"""Tests of the contract's crowd schemas against the decoder and the encoder."""

import json

import jsonschema
import numpy as np
import orjson
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from posefield.common.errors import FormError, InvalidField
from posefield.encode.formats import CROWD_ENCODERS
from posefield.http import crowd_operations
from posefield.motion.clip import CrowdPoses
from posefield.motion.skeleton import Skeleton


def checker(spec, name):
    schema = {**spec["components"]["schemas"][name], "components": spec["components"]}
    return jsonschema.Draft202012Validator(schema)


def test_what_json_holds_matches_the_schema(spec):
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
        np.array([True, False]),
        ("it is slow",),
    )
    content = orjson.loads(CROWD_ENCODERS["json"].encode(poses))
    schema = checker(spec, "CrowdPoses")
    schema.validate(content)
    curves = {"curve_names", "curves"}
    assert content.keys() == schema.schema["properties"].keys() - curves
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
def test_what_breaks_the_schema_is_refused_and_nothing_else_is_a_bad_body(spec, data):
    schema = checker(spec, "CrowdQuestion")
    fields = [*schema.schema["properties"], "times"]
    body = {"controls": {"speed": 1}, "time": 0} | data.draw(
        st.dictionaries(st.sampled_from(fields), VALUES, max_size=3)
    )
    try:
        crowd_operations.of_body(json.dumps(body).encode(), 100)
    except FormError:
        assert not schema.is_valid(body)
    except InvalidField:
        pass
    else:
        schema.validate(body)
