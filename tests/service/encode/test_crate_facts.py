"""Facts that this package writes into binary layers, as usd-core reads them and writes its own."""

import math
import struct
from enum import StrEnum
from types import MappingProxyType

import numpy as np
import pytest
from test_crate import Plain, built, content
from test_facts import GIVEN

from posefield.encode import crate_template, layers


class Word(StrEnum):
    LEFT = "left"


NUMBERS = [0.1, 0.25, -0.0, 1e300, 3.4028235677973366e38, 1e-45, math.inf, -math.inf, math.nan]
INTEGERS = [0, -1, 2**31 - 1, 2**31, -(2**31), -(2**31) - 1, 2**63 - 1, -(2**63) + 1, 2**64]
TEXTS = [
    "",
    "Anim",
    "posefield",
    "rotations",
    "\u00fcn\u00efcode \u5de6\u8155",
    'quo"ted\n',
    "x" * 5000,
]
CASES = [
    GIVEN,
    {"numbers": NUMBERS, **{f"n{index}": number for index, number in enumerate(NUMBERS)}},
    {f"i{index}": number for index, number in enumerate(INTEGERS)},
    {"integers": INTEGERS[:-1], "more": INTEGERS, "truths": [True, False], "mixed": [1, "a"]},
    {"texts": TEXTS, **{f"t{index}": text for index, text in enumerate(TEXTS)}},
    {"a": {"b": {"c": {"d": 0.1, "e": [0.1, 0.2]}, "z": {}}, "none": None}, "last": {"x": 1.5}},
    {f"fact {index}": index / 3 for index in range(1000)},
    {"": "", "only": []},
    MappingProxyType({"inner": MappingProxyType({"x": np.float32(0.1)}), "word": Word("left")}),
]


@pytest.mark.parametrize("facts", CASES, ids=[next(iter(facts)) for facts in CASES])
def test_facts_are_read_as_those_that_usd_writes(facts):
    made = content(1)._replace(facts=facts)
    found = layers.crate_text(crate_template.usdc(Plain(), made))
    assert found == built(Plain(), made)
    other = made._replace(facts={**facts, "another": 0.1})
    assert layers.crate_text(crate_template.usdc(Plain(), other)) != found


def test_values_that_are_read_where_they_lie_are_aligned():
    for length in range(8):
        made = content(1)._replace(facts={"a": "x" * length, "b": [0.1] * 3, "c": 0.1 + length})
        found = crate_template.usdc(Plain(), made)
        assert found.index(struct.pack("<Qddd", 3, 0.1, 0.1, 0.1)) % 8 == 0


def test_a_text_with_the_end_of_a_token_is_an_error():
    made = content(1)._replace(facts={"a": "x\0y"})
    with pytest.raises(ValueError, match="a fact with the character NUL, expected text without"):
        crate_template.usdc(Plain(), made)
