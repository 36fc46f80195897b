"""Tests of samplings: stratification, points in the hull and reproducible bytes."""

from collections import Counter
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rowing import Usual, rows
from scipy.optimize import linprog
from scipy.stats import chisquare

from posefield.batch import rows as sampling
from posefield.batch.rows import BLOCK_SIZE, RowFault
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry

# Chance gives less once in a million times.
UNLIKELY = 1e-6
# A point is a sum of a few products of numbers up to 100.
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture(scope="module")
def card(model):
    return model.session.card


def drawn(card, method, count, seed=0):
    return np.concatenate(list(sampling.METHODS[method](card, count, seed)))


def continua(card):
    """The card with every control a continuum."""
    return replace(card, controls=tuple(replace(c, values=()) for c in card.controls))


@given(count=st.integers(1, 3000), seed=st.integers(0, 2**63))
@settings(max_examples=60, deadline=None)
def test_a_permutation_sends_every_place_to_another(count, seed):
    sent = sampling.permute(np.arange(count, dtype=np.uint64), count, (seed,))
    assert sorted(sent.tolist()) == list(range(count))


def test_permutations_of_four_are_all_equally_likely():
    places = np.arange(4, dtype=np.uint64)
    found = Counter(tuple(sampling.permute(places, 4, (s,)).tolist()) for s in range(4800))
    assert chisquare([found[order] for order in permutations(range(4))]).pvalue > UNLIKELY


@pytest.mark.parametrize("count", [1, 2, 7, 1000, 2 * BLOCK_SIZE + 77])
def test_a_latin_hypercube_hits_every_stratum_once(card, count):
    low, high = np.array([(each.minimum, each.maximum) for each in card.controls]).T
    found = np.sort((drawn(continua(card), "latin", count) - low) / (high - low), axis=0)
    assert found.shape == (count, 4)
    parts = np.arange(count)[:, None]
    # A point may lie at the edge of its part, to rounding.
    assert np.all((count * found >= parts - 1e-6) & (count * found <= parts + 1 + 1e-6))


def test_a_control_of_few_values_takes_them_in_equal_shares(card):
    statures = card.controls[0].values
    assert len(statures) == 3
    found = Counter(drawn(card, "latin", 10_000)[:, 0].tolist())
    assert set(found) == set(statures)
    assert max(found.values()) - min(found.values()) <= 1


def test_points_of_the_hull_are_mixtures_of_captured_clips(card):
    equal = np.vstack([np.array(card.examples).T, np.ones(len(card.examples))])
    for point in drawn(card, "hull", 200):
        found = linprog(np.zeros(len(card.examples)), A_eq=equal, b_eq=[*point, 1.0])
        assert found.status == 0


def test_weights_are_even_in_the_simplex(card):
    """Even weights of n corners have E w^2 = 2 / (n (n + 1)); here n = 5."""
    corners = replace(card, examples=tuple(map(tuple, np.eye(4).tolist())))
    points = drawn(corners, "hull", 50_000)
    # A corner is each of the four examples alike: variance p (1 - p) n E w^2.
    expected = (1 / 4) * (3 / 4) * (2 / 6)
    assert points.var(0) == pytest.approx([expected] * 4, rel=0.03)
    assert points.sum(1) == pytest.approx(np.ones(50_000), abs=ROUNDING)


@pytest.mark.parametrize("method", sampling.METHODS)
def test_every_point_can_be_asked_for_where_it_was_sampled(model, method):
    strict = Usual(question=ClipQuestion(controls={}, extrapolate="refuse"))
    found = rows(model, usual=strict, sample=10_000, method=method)
    faults = [row for row in found if isinstance(row, RowFault)]
    # What was sampled has gaps, in which a box's points fall more often than those of the hull.
    assert all("in a gap" in fault.message for fault in faults)
    assert len(faults) < {"latin": 3_000, "hull": 300}[method]


@pytest.mark.parametrize("method", sampling.METHODS)
def test_seeds_differ_and_are_kept_to(card, method):
    assert np.array_equal(drawn(card, method, 100, 1), drawn(card, method, 100, 1))
    assert not np.array_equal(drawn(card, method, 100, 1), drawn(card, method, 100, 2))


def test_numbers_of_a_seed_are_those_of_ever(card):
    """Golden: NumPy may not change them, nor may we without a word in the changelog."""
    plain = [replace(c, minimum=0.0, maximum=1.0, values=()) for c in card.controls[:2]]
    square = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0))
    plain_card = replace(card, controls=tuple(plain), examples=square)
    sent = sampling.permute(np.arange(10, dtype=np.uint64), 10, (0,))
    assert sent.tolist() == [4, 6, 8, 9, 0, 2, 5, 7, 3, 1]
    assert drawn(plain_card, "latin", 2, 7).tolist() == LATIN
    assert drawn(plain_card, "hull", 2, 7).tolist() == HULL


LATIN = [[0.3125477333023335, 0.8850704755017371], [0.9486069004847877, 0.05596362215884215]]
HULL = [[0.7747928100094081, 1.0], [0.6708655240916745, 0.6708655240916745]]
