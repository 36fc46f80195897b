"""Tests of rank selection, against a search over all ranks."""

from itertools import product

import numpy as np
import pytest

from posefield.common.errors import TrainingError
from posefield_train.graph import truncation_cost
from posefield_train.graph.truncation_cost import RankCost
from posefield_train.tensor import hosvd

PER_RANK = (13, 5, 9)
PRICES = [PER_RANK, (40, 1, 1), (1, 40, 1), (1, 1, 40)]


@pytest.fixture
def full(rng):
    """Decomposition of a tensor whose singular values fall."""
    fading = [np.exp(-0.7 * np.arange(size)) for size in (6, 5, 7)]
    core = rng.normal(size=(6, 5, 7)) * np.einsum("a,b,c->abc", *fading)
    return hosvd.decompose(core)


def stored(triple, per_rank=PER_RANK):
    return np.prod(triple) + np.dot(per_rank, triple)


def smallest(core, allowed, per_rank=PER_RANK):
    """Ranks of least cost whose squared error is at most `allowed`."""
    front, errors = (
        truncation_cost.pareto_front(core, RankCost(per_rank)),
        hosvd.squared_errors(core),
    )

    def strain(triple):
        error = errors[tuple(rank - 1 for rank in triple)]
        return np.sqrt(error / allowed) if allowed else float(error > 1e-12 * np.sum(core**2)) * 2

    return truncation_cost.cheapest_within(front, strain, allowed)


def truncation(full, triple):
    return np.sum(np.square(full.truncated(triple).restored() - full.restored()))


@pytest.mark.parametrize("per_rank", PRICES, ids=str)
@pytest.mark.parametrize("share", [0.3, 0.03, 1e-5])
def test_smallest_ranks_are_those_of_trying_all(full, share, per_rank):
    allowed = share * np.sum(np.square(full.core))
    triples = list(product(*(range(1, size + 1) for size in full.core.shape)))
    fits = [triple for triple in triples if truncation(full, triple) <= allowed]
    found = smallest(full.core, allowed, per_rank)
    assert found in fits
    assert stored(found, per_rank) == min(stored(triple, per_rank) for triple in fits)
    assert stored(found, per_rank) > min(stored(triple, per_rank) for triple in triples)


def test_no_error_allowed_keeps_no_more_than_there_is(rng):
    core = np.zeros((6, 5, 7))
    core[:3, :2, :4] = rng.normal(size=(3, 2, 4))
    assert smallest(core, 0.0) == (3, 2, 4)


def test_front_holds_every_triple_to_which_nothing_cheaper_is_as_good(full):
    front, errors = (
        truncation_cost.pareto_front(full.core, RankCost(PER_RANK)),
        hosvd.squared_errors(full.core),
    )
    triples = list(product(*(range(1, size + 1) for size in full.core.shape)))
    scored = [(stored(t), errors[tuple(r - 1 for r in t)], t) for t in triples]
    best = {
        t for cost, error, t in scored if not any(c < cost and e <= error for c, e, _ in scored)
    }
    found = {front[place] for place in range(len(front.errors))}
    assert found <= best
    # Of several at one price the front keeps the best.
    prices = [stored(front[place]) for place in range(len(front.errors))]
    assert set(prices) == {
        stored(t) for t in best if errors[tuple(r - 1 for r in t)] in front.errors
    }
    assert prices == sorted(prices) and len(set(prices)) == len(prices)
    assert np.all(np.diff(front.errors) < 0) and front.errors[-1] < 1e-10
    assert len(found) < len(triples) / 2, "negative control: most triples are not on it"


def strained(front, bend):
    """True errors that a factor `bend` and more than the front's own tell apart from them."""

    def strain(triple):
        place = next(i for i in range(len(front.errors)) if front[i] == triple)
        strain.asked.append(place)
        return float(bend * np.sqrt(front.errors[place] / front.errors[len(front.errors) // 3]))

    strain.asked = []
    return strain


@pytest.mark.parametrize("bend", [0.2, 1.0, 5.0])
def test_budget_is_one_on_true_errors_whatever_the_metric_says(full, bend):
    front = truncation_cost.pareto_front(full.core, RankCost(PER_RANK))
    strain = strained(front, bend)
    aim = front.errors[len(front.errors) // 3]
    found = truncation_cost.cheapest_within(front, strain, aim)
    asked = len(strain.asked)
    meets = [i for i in range(len(front.errors)) if strain(front[i]) <= 1.0]
    assert found == front[meets[0]]
    assert asked <= 2 * np.log2(len(front.errors)) + 2
    if bend != 1.0:
        by_metric = int(np.flatnonzero(front.errors <= aim)[0])
        assert found != front[by_metric], "negative control: the metric's own ranks"


@pytest.mark.parametrize("seed", range(3))
def test_what_is_returned_keeps_the_budget_even_where_true_errors_do_not_fall(full, seed):
    front = truncation_cost.pareto_front(full.core, RankCost(PER_RANK))
    noise = np.random.Generator(np.random.PCG64(seed)).uniform(0.5, 2.0, len(front.errors))
    middle = front.errors[len(front.errors) // 2]
    strains = noise * np.sqrt(front.errors / middle)
    by_triple = {front[i]: float(strain) for i, strain in enumerate(strains)}
    assert by_triple[truncation_cost.cheapest_within(front, by_triple.__getitem__, middle)] <= 1.0
    assert np.any(np.diff(strains) > 0.0), "negative control: they do not fall"


def test_given_ranks_are_kept_and_those_beyond_the_tensor_refused(full):
    assert truncation_cost.recipe_ranks(full.core, [6, 1, 3]) == (6, 1, 3)
    with pytest.raises(TrainingError) as refusal:
        truncation_cost.recipe_ranks(full.core, [1, 1, 8])
    assert str(refusal.value) == (
        "size.ranks [1, 1, 8], expected at most [6, 5, 7]: degrees of freedom, frames and "
        "samples of the tensor"
    )
