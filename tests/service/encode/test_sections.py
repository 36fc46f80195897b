"""Tests of the parser of binary layers: unknown structures are refused."""

import random
import struct

import pytest
from pxr import Sdf

from posefield.encode.usd_layers import crate_sections, layer_metadata


@pytest.fixture(scope="module")
def data():
    made = Sdf.Layer.CreateAnonymous("any.usda")
    spec = Sdf.AttributeSpec(
        Sdf.PrimSpec(made, "Any", Sdf.SpecifierDef), "a", Sdf.ValueTypeNames.Double
    )
    spec.default = 1.0 / 3.0
    return layer_metadata.crate_bytes(made)


def with_table(data, place):
    return (
        data[: crate_sections.TABLE_OFFSET_POSITION]
        + struct.pack("<q", place)
        + data[crate_sections.TABLE_OFFSET_POSITION + 8 :]
    )


def test_pieces_are_put_together_again(data):
    found = crate_sections.split_crate(data)
    assert crate_sections.join_crate(bytearray(found.values), found.sections) == data


def test_a_layer_that_breaks_off_is_refused(data):
    assert not any(crate_sections.split_crate(data[:size]) for size in range(len(data)))


def test_a_table_elsewhere_is_refused(data):
    rng = random.Random(0)
    places = [*range(-50, len(data) + 50), *(rng.randrange(-(2**63), 2**63) for _ in range(200))]
    places.remove(*struct.unpack_from("<q", data, crate_sections.TABLE_OFFSET_POSITION))
    assert not any(crate_sections.split_crate(with_table(data, place)) for place in places)
