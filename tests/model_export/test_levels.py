"""Tests of levels of detail: nested, increasingly coarse, each within its error limit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import onnxruntime
import pytest

from posefield.common.errors import TrainingError
from posefield.inference import session
from posefield.inference.onnx_runtime import OUTPUTS
from posefield.motion import skeleton
from posefield_train.graph import levels
from posefield_train.source.recipe_sections import Detail

HAND = "LeftHand"


def with_levels(recipe, *details):
    return recipe.model_copy(update={"size": recipe.size.model_copy(update={"levels": details})})


@pytest.fixture(scope="module")
def still(small_recipe, trained):
    """Levels of which the coarser ones keep a hand, and then a whole arm, still."""
    details = Detail(times=2.0, drop_joints=[HAND]), Detail(times=8.0, drop_joints=["LeftArm"])
    recipe = with_levels(small_recipe, *details)
    return levels.build_levels(replace(trained, recipe=recipe))


def test_every_level_is_a_leading_part_of_the_one_before(exported):
    ladder = exported.card.levels
    assert len(ladder) == 4
    for finer, coarser in pairwise(ladder):
        assert all(low <= high for low, high in zip(coarser.ranks, finer.ranks, strict=True))
        assert coarser.samples <= finer.samples
        assert set(coarser.joints) <= set(finer.joints)
    whole, last = exported.model.decoder.reduced, exported.model.decoder.at_level(3).reduced
    r1, r2, r3 = ladder[3].ranks
    assert np.array_equal(last.core, whole.core[:r1, :r2, :r3])
    assert not np.array_equal(last.core, whole.core[-r1:, -r2:, -r3:])


def test_errors_keep_the_budgets_times_what_the_level_may_cost(small_recipe, exported):
    budgets = small_recipe.size.budgets
    for times, level in zip((1, 2, 4, 8), exported.card.levels, strict=True):
        for name, budget in budgets.items():
            # Levels are tried with some questions, and measured with others.
            assert getattr(level, name) <= 1.05 * times * budget
        # Negative control: half of it would not do.
        assert level.rms > 0.5 * times * budgets["rms"]
        assert level.rms < level.p99 < level.max


def test_joints_that_a_level_drops_do_not_move(still, trained):
    model, listed = still
    names, parents = trained.skeleton.names, trained.skeleton.parents
    arm, hand = names.index("LeftArm"), names.index(HAND)
    below = np.flatnonzero(skeleton.descendant_matrix(parents)[arm])
    assert hand in below
    dropped = [set(range(len(names))) - set(level.joints) for level in listed]
    assert dropped[0] == set()
    assert hand in dropped[1] and arm not in dropped[1]
    assert dropped[2] == set(below.tolist()) > dropped[1]
    low, high = model.bank.low, model.bank.high
    points = np.linspace(low, high, 20)
    for level in range(3):
        turns = model.evaluate(points, np.full((20, 1), 0.5), level=level).rotations[:, 0]
        moved = np.flatnonzero(np.ptp(turns, axis=0).max(axis=-1) > 1e-6)
        assert not set(moved) & dropped[level]
        assert arm in moved or level == 2


@pytest.mark.parametrize("joint", ["Hips", "Tail"])
def test_joints_that_cannot_be_dropped_are_named(small_recipe, trained, joint):
    asked = with_levels(small_recipe, Detail(times=2.0, drop_joints=[joint]))
    with pytest.raises(TrainingError, match=rf"drop_joints \['{joint}'\], expected some of "):
        levels.build_levels(replace(trained, recipe=asked))


# --- the file -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def question(exported):
    rng = np.random.Generator(np.random.PCG64(3))
    low, high = exported.model.bank.low, exported.model.bank.high
    return rng.uniform(low, high, (20, len(low))).astype("f4"), rng.uniform(0, 1, (20, 3)).astype(
        "f4"
    )


def runtime(content):
    return onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])


def test_a_level_fed_to_the_file_is_the_level_of_the_service(model_path, question):
    """The service makes the level a constant; the file itself recordings it as an input."""
    opened, plain = session.load(model_path), runtime(model_path.read_bytes())
    feed = dict(zip(("controls", "time"), question, strict=True))
    for level in range(4):
        fed = plain.run(list(OUTPUTS), {**feed, "level": np.array(level)})
        found = opened.run(*question, *OUTPUTS, level=level)
        other = opened.run(*question, *OUTPUTS, level=(level + 1) % 4)
        # Weights laid out beforehand are summed in another order.
        assert max(np.abs(a - b).max() for a, b in zip(fed, found, strict=True)) < 1e-5
        assert max(np.abs(a - b).max() for a, b in zip(fed, other, strict=True)) > 1e-3
