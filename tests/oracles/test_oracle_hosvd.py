"""Comparison of the HOSVD with pyttb's."""

import numpy as np
import pytest
import pyttb

from posefield_train.tensor import hosvd

TOLERANCE = 1e-9
SHAPES = [(5, 4, 3), (6, 8, 7), (4, 3, 5, 2)]


@pytest.fixture(params=SHAPES, ids=str)
def tensor(request, rng):
    return rng.normal(size=request.param)


def theirs(tensor, ranks):
    return pyttb.hosvd(
        pyttb.tensor(tensor), tol=1e-12, verbosity=0, sequential=False, ranks=np.array(ranks)
    )


def aligned(own, other):
    """Core and bases of the other with the signs of one's own."""
    core = other.core.double()
    bases = []
    for mode, (a, b) in enumerate(zip(own.bases, other.factor_matrices, strict=True)):
        signs = np.sign(np.sum(a * b, axis=0))
        bases.append(b * signs)
        core = hosvd.mode_dot(core, np.diag(signs), mode)
    return core, bases


def test_core_and_bases_are_theirs_up_to_sign(tensor):
    own = hosvd.decompose(tensor)
    core, bases = aligned(own, theirs(tensor, tensor.shape))
    assert np.max(np.abs(own.core - core)) < TOLERANCE
    for a, b in zip(own.bases, bases, strict=True):
        assert np.max(np.abs(a - b)) < TOLERANCE
    assert np.max(np.abs(own.core - tensor)) > 0.1


def test_truncation_is_theirs(tensor):
    ranks = tuple(max(size - 1, 1) for size in tensor.shape)
    found = hosvd.decompose(tensor).truncated(ranks).restored()
    expected = theirs(tensor, ranks).full().double()
    assert np.max(np.abs(found - expected)) < TOLERANCE
    assert np.max(np.abs(found - tensor)) > 1e-2


def test_unfolding_is_theirs(tensor):
    for mode in range(tensor.ndim):
        own = hosvd.unfold(tensor, mode)
        other = pyttb.tensor(tensor).to_tenmat(np.array([mode])).double()
        # They order columns by the first axis, not the last: the products are the same.
        assert np.max(np.abs(own @ own.T - other @ other.T)) < TOLERANCE
        assert own.shape == other.shape
