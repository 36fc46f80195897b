"""Tests of the HOSVD theorems of De Lathauwer, De Moor and Vandewalle (2000), on many shapes."""

from itertools import product

import numpy as np
import pytest

from posefield.common.errors import TrainingError
from posefield_train.tensor import hosvd

SHAPES = [(5, 4, 3), (3, 7, 4), (2, 9, 3), (4, 3, 2, 5)]
# Roundings of sums of a few hundred products of numbers of size one.
TOLERANCE = 1e-11


@pytest.fixture(params=SHAPES, ids=str)
def tensor(request, rng):
    return rng.normal(size=request.param)


def gram(core, mode):
    unfolded = hosvd.unfold(core, mode)
    return unfolded @ unfolded.T


def off_diagonal(matrix):
    return np.max(np.abs(matrix - np.diag(np.diagonal(matrix))), initial=0.0)


def test_full_ranks_restore_the_tensor(tensor):
    full = hosvd.decompose(tensor)
    assert np.max(np.abs(full.restored() - tensor)) < TOLERANCE
    one_short = full.truncated((*full.core.shape[:-1], full.core.shape[-1] - 1))
    assert np.max(np.abs(one_short.restored() - tensor)) > 1e-3


def test_bases_are_orthonormal(tensor):
    for basis in hosvd.decompose(tensor).bases:
        assert np.max(np.abs(basis.T @ basis - np.eye(basis.shape[1]))) < TOLERANCE


def test_core_is_all_orthogonal(tensor):
    core = hosvd.decompose(tensor).core
    for mode in range(core.ndim):
        assert off_diagonal(gram(core, mode)) < TOLERANCE
        assert off_diagonal(gram(tensor, mode)) > 1e-2


def test_slices_of_the_core_are_ordered(tensor):
    core = hosvd.decompose(tensor).core
    for mode in range(core.ndim):
        norms = np.linalg.norm(hosvd.unfold(core, mode), axis=1)
        assert np.all(np.diff(norms) <= TOLERANCE)
    assert any(
        np.any(np.diff(np.linalg.norm(hosvd.unfold(tensor, mode), axis=1)) > TOLERANCE)
        for mode in range(core.ndim)
    )


def test_norms_of_slices_are_the_singular_values(tensor):
    core = hosvd.decompose(tensor).core
    for mode in range(core.ndim):
        norms = np.linalg.norm(hosvd.unfold(core, mode), axis=1)
        singular = np.linalg.svd(hosvd.unfold(tensor, mode), compute_uv=False)
        # The Gram matrix's eigenvalues are squares: what is zero here is 1e-8 there.
        assert np.max(np.abs(norms[: len(singular)] - singular)) < 1e-7


def left_out(core, ranks):
    """Squared singular values that ranks cut off, summed for each mode."""
    unfolded = (hosvd.unfold(core, mode) for mode in range(core.ndim))
    return [np.sum(np.square(rows[rank:])) for rows, rank in zip(unfolded, ranks, strict=True)]


def all_ranks(core):
    return product(*(range(1, size + 1) for size in core.shape))


def test_error_of_every_truncation_is_known_beforehand(tensor):
    full = hosvd.decompose(tensor)
    known = hosvd.squared_errors(full.core)
    bounds = []
    for ranks in all_ranks(full.core):
        true = np.sum(np.square(full.truncated(ranks).restored() - tensor))
        assert abs(true - known[tuple(rank - 1 for rank in ranks)]) < TOLERANCE
        bounds.append(abs(true - sum(left_out(full.core, ranks))))
    assert max(bounds) > 1e-1


def test_error_of_every_truncation_keeps_within_the_bounds(tensor):
    full = hosvd.decompose(tensor)
    known = hosvd.squared_errors(full.core)
    worst = []
    for ranks in all_ranks(full.core):
        left = left_out(full.core, ranks)
        error = known[tuple(rank - 1 for rank in ranks)]
        assert max(left) - TOLERANCE <= error <= sum(left) + TOLERANCE
        last = full.core[
            tuple(slice(size - rank, size) for size, rank in zip(tensor.shape, ranks, strict=True))
        ]
        worst.append(np.sum(np.square(full.core)) - np.sum(np.square(last)) - sum(left))
    assert max(worst) > 1e-1, "keeping the last vectors and not the first breaks the upper bound"


def test_largest_entry_of_every_basis_vector_is_positive(tensor):
    for basis in hosvd.decompose(tensor).bases:
        largest = basis[np.argmax(np.abs(basis), axis=0), np.arange(basis.shape[1])]
        assert np.all(largest > 0)


@pytest.mark.parametrize("mode", range(3))
def test_reordered_samples_reorder_a_basis_and_nothing_else(mode, rng):
    tensor = rng.normal(size=(5, 6, 4))
    order = rng.permutation(tensor.shape[mode])
    first, second = hosvd.decompose(tensor), hosvd.decompose(np.take(tensor, order, axis=mode))
    assert np.max(np.abs(second.core - first.core)) < TOLERANCE
    for own, (a, b) in enumerate(zip(first.bases, second.bases, strict=True)):
        expected = a[order] if own == mode else a
        assert np.max(np.abs(b - expected)) < TOLERANCE
    assert np.max(np.abs(second.bases[mode] - first.bases[mode])) > 0.1


@pytest.mark.parametrize("ranks", [(0, 2, 2), (3, 3, 2)])
def test_rank_that_is_not_there_is_refused(ranks, rng):
    full = hosvd.decompose(rng.normal(size=(3, 2, 4)))
    with pytest.raises(TrainingError) as refusal:
        full.truncated(ranks)
    assert str(refusal.value) == f"ranks {ranks}, expected 1 to (3, 2, 4)"


# --- in passes over many clips --------------------------------------------------------------------


@pytest.fixture
def motions(rng):
    """Tensor of 700 clips in three blocks: a smooth part, and noise a thousandth as large."""
    whole = np.einsum(
        "ak,bk,ck->abc",
        rng.normal(size=(9, 4)),
        rng.normal(size=(12, 4)),
        rng.normal(size=(700, 4)),
    )
    return whole + 1e-3 * rng.normal(size=whole.shape)


def test_passes_over_blocks_give_the_decomposition_of_all_at_once(motions):
    whole, passes = hosvd.decompose(motions), hosvd.decompose_in_passes(motions, 0.0)
    for one, other in zip(whole.bases[:2], passes.bases[:2], strict=True):
        # The noise's directions are nearly equal in size, and so less certain.
        assert np.max(np.abs(one - other)) < 1e-6
    assert np.max(np.abs(passes.restored() - motions)) < 1e-10
    rank = passes.core.shape[2]
    assert np.max(np.abs(whole.bases[2][:, :rank] - passes.bases[2])) < 1e-6
    assert np.max(np.abs(passes.bases[2].T @ passes.bases[2] - np.eye(rank))) < TOLERANCE


def test_projections_leave_out_no_more_than_told(motions):
    allowed = 2.0 * 1e-6 * motions.size
    passes = hosvd.decompose_in_passes(motions, allowed)
    assert passes.core.shape == (4, 4, 4)
    missed = float(np.sum(np.square(passes.restored() - motions)))
    assert 0.0 < missed <= 3.0 * allowed
    # Negative control: one direction less leaves out more.
    fewer = passes.truncated((4, 4, 3))
    assert float(np.sum(np.square(fewer.restored() - motions))) > 3.0 * allowed
