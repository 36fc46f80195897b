"""Tests of the cost of ranks: stored numbers and operations per pose."""

import onnx
import pytest
from onnx import numpy_helper

from posefield_train.graph import truncation_cost
from posefield_train.graph.truncation_cost import RankCost

RANKS = (3, 4, 5)


def test_price_is_of_the_core_of_each_rank_and_of_pairs():
    assert RankCost((100, 10, 1)).evaluate(*RANKS) == 60 + 300 + 40 + 5
    assert RankCost((100, 10, 1), pair=2).evaluate(*RANKS) == 60 + 300 + 40 + 5 + 24


@pytest.fixture(scope="module")
def held(exported):
    """Numbers that the file of the small model holds, by name."""
    graph = onnx.load_from_string(exported.content).graph
    return {own.name: numpy_helper.to_array(own) for own in graph.initializer}


def test_numbers_are_those_that_the_file_holds(held, trained):
    ranks = trained.model.decoder.reduced.core.shape
    motion = sum(held[name].size for name in ("core", "directions", "time_basis"))
    # What the event's prediction adds stands behind the coefficients of the core.
    motion += held["pose_weights"][:, : ranks[2]].size
    # Those of one and of the controls stand side by side for all quantities.
    drift = ranks[2] * len(held["linear_weights"])
    assert motion + drift == truncation_cost.storage_cost(trained.tensor, 4).evaluate(*ranks)
    assert motion + drift < sum(own.size for own in held.values()), "sigma's matrix is the largest"


def test_levels_read_what_the_file_holds_for_them(held, exported):
    model, levels = exported.model, exported.card.levels
    finest = ("core", "directions", "time_basis", "samples", "precision")
    duals = [f"{name}_weights" for name in ("pose", *model.bank.other_models)]
    drift = held["linear_weights"][:, 2:].size
    assert levels[0].event, "the family has an event, and its prediction pays"
    blend = ("event_mixing", "event_times")
    whole = sum(held[name].size for name in (*finest, *blend, *(n for n in duals if n in held)))
    assert levels[0].numbers == whole + drift
    for number, level in enumerate(levels[1:], start=1):
        r1, r2, r3 = level.ranks
        bases = r1 * len(held["directions"]) + r2 * held["time_basis"].shape[1]
        own = held[f"weights_{number}"].size + 4 * level.samples
        assert level.numbers == r1 * r2 * r3 + bases + own < levels[number - 1].numbers
        assert level.bytes == 4 * level.numbers
        assert level.operations < levels[number - 1].operations


def test_compression_is_the_raw_tensor_over_what_is_stored(trained):
    freedoms, frames, samples = trained.tensor.values.shape
    raw = freedoms * frames * samples
    found = truncation_cost.tensor_compression(trained.tensor, (22, 6, 24), 4)
    bases = freedoms * 22 + frames * 6 + (samples + 5) * 24
    assert found.core == pytest.approx(raw / (22 * 6 * 24))
    assert found.stored == pytest.approx(raw / (22 * 6 * 24 + bases))
    assert truncation_cost.tensor_compression(trained.tensor, (22, 6, 25), 4).stored < found.stored


def test_operations_are_those_of_the_products_of_one_pose(trained):
    joints, (_, _, samples) = len(trained.skeleton), trained.tensor.values.shape
    r1, r2, r3 = RANKS
    products = {
        "kriging": (samples + 5) * r3,
        "core": r1 * r2 * r3,
        "line between frames": r2,
        "time": r1 * r2,
        "decoding": r1 * (4 * joints + 3),
    }
    assert truncation_cost.operation_cost(trained.tensor, 4).evaluate(*RANKS) == sum(
        products.values()
    )
