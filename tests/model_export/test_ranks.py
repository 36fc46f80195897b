"""How much of the core to keep: every triple is looked at."""

from itertools import product

import numpy as np
import pytest

from model_export import hosvd, ranks
from service.motion.errors import TrainingError

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


def truncation(full, triple):
    return np.sum(np.square(full.truncated(triple).restored() - full.restored()))


@pytest.mark.parametrize("per_rank", PRICES, ids=str)
@pytest.mark.parametrize("share", [0.3, 0.1, 0.03, 1e-3, 1e-5])
def test_smallest_ranks_are_those_of_trying_all(full, share, per_rank):
    allowed = share * np.sum(np.square(full.core))
    triples = list(product(*(range(1, size + 1) for size in full.core.shape)))
    fits = [triple for triple in triples if truncation(full, triple) <= allowed]
    found = ranks.smallest(full.core, allowed, per_rank)
    assert found in fits
    assert stored(found, per_rank) == min(stored(triple, per_rank) for triple in fits)
    assert stored(found, per_rank) > min(stored(triple, per_rank) for triple in triples)


def test_price_of_a_rank_decides_between_modes(rng):
    core = hosvd.decompose(rng.normal(size=(6, 6, 6))).core
    allowed = 0.4 * np.sum(np.square(core))
    dear_first = ranks.smallest(core, allowed, (10_000, 1, 1))
    dear_last = ranks.smallest(core, allowed, (1, 1, 10_000))
    assert dear_first[0] < dear_last[0]
    assert dear_first[2] > dear_last[2]


def test_no_error_allowed_keeps_all(full):
    assert ranks.smallest(full.core, 0.0, PER_RANK) == full.core.shape


def test_no_error_allowed_keeps_no_more_than_there_is(rng):
    core = np.zeros((6, 5, 7))
    core[:3, :2, :4] = rng.normal(size=(3, 2, 4))
    assert ranks.smallest(core, 0.0, PER_RANK) == (3, 2, 4)


def test_every_error_allowed_keeps_one(full):
    assert ranks.smallest(full.core, np.sum(np.square(full.core)), PER_RANK) == (1, 1, 1)


def test_larger_budget_never_stores_more(full):
    total = np.sum(np.square(full.core))
    sizes = [
        stored(ranks.smallest(full.core, s * total, PER_RANK)) for s in np.geomspace(1e-6, 1, 30)
    ]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > sizes[-1]


def test_given_ranks_are_kept(full):
    assert ranks.given(full.core, [6, 1, 3]) == (6, 1, 3)


@pytest.mark.parametrize("wanted", [[7, 5, 7], [6, 6, 7], [1, 1, 8]])
def test_ranks_beyond_the_tensor_are_refused(full, wanted):
    with pytest.raises(TrainingError) as refusal:
        ranks.given(full.core, wanted)
    assert str(refusal.value) == (
        f"size.ranks {wanted}, expected at most [6, 5, 7]: degrees of freedom, frames and "
        "samples of the tensor"
    )
