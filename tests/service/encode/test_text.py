"""Comparison of number formatting and whole text layers with usd-core."""

import re

import numpy as np
import pytest
from pxr import Sdf, Vt

from posefield.encode.usd_layers import text_template
from posefield.encode.usd_layers.prim_specs import ValueTypes, prim, varying_attribute


def usd(values):
    """Each number as usd-core spells it."""
    kind, array = (
        (ValueTypes.FloatArray, Vt.FloatArray)
        if values.dtype == np.float32
        else (ValueTypes.DoubleArray, Vt.DoubleArray)
    )
    layer = Sdf.Layer.CreateAnonymous("numbers.usda")
    varying_attribute(prim(layer, "Numbers", "Scope"), "all", kind, array.FromNumpy(values))
    return re.search(r"= \[(.*)\]", layer.ExportToString()).group(1).split(", ")


def ours(values):
    (row,) = text_template.row_texts(values.reshape(1, -1, 1))
    return row.decode().split("), (")


def numbers(kind, count=100_000):
    """Plain numbers of every size, from random bits, and those that are odd to spell."""
    size = np.dtype(kind).itemsize
    bits = np.random.default_rng(1).integers(0, 2 ** (8 * size), count, f"u{size}").view(kind)
    powers = 10.0 ** np.arange(-45, 13)
    odd = [
        0.0,
        -0.0,
        1 / 3,
        2 / 3,
        16777216,
        33554433,
        123456789,
        9999999,
        0.5,
        1e-45,
        1.1754942e-38,
    ]
    every = np.concatenate([bits, powers, 1.5 * powers, -9.99 * powers / 10, odd, range(2000)])
    every = every[np.isfinite(every)].astype(kind)
    return np.array([number for number in every if text_template.all_plain(number)], kind)


@pytest.mark.parametrize("kind", ["f4", "f8"])
@pytest.mark.filterwarnings("ignore:overflow encountered in cast", "ignore:invalid value")
def test_plain_numbers_are_spelt_as_usd_does(kind):
    values = numbers(kind)
    assert len(values) > 1000
    assert ours(values) == usd(values)


@pytest.mark.parametrize(
    ("value", "kind"),
    [(2e13, "f4"), (np.nan, "f4"), (-np.inf, "f4"), (3e-6, "f8"), (2e13, "f8"), (np.nan, "f8")],
)
def test_other_numbers_would_be_spelt_in_another_way(value, kind):
    values = np.array([value, 1.5], kind)
    assert not text_template.all_plain(values)
    assert value in (2e13,) * (kind == "f8") or ours(values) != usd(values)


def test_rows_of_vectors_are_told_apart():
    rows = np.arange(12, dtype="f4").reshape(2, 2, 3)
    assert text_template.row_texts(rows) == [b"0, 1, 2), (3, 4, 5", b"6, 7, 8), (9, 10, 11"]
    assert text_template.vector_texts(rows) == text_template.row_texts(rows)
    rows[1, 1] = rows[0, 1]
    assert text_template.vector_texts(rows) == text_template.row_texts(rows)
    assert text_template.vector_texts(rows[:, :1]) == text_template.row_texts(rows[:, :1])
    (quaternion,) = text_template.quaternion_texts(np.array([[[1, 2, 3, 4]]], "f4"))
    assert quaternion == b"4, 1, 2, 3"
