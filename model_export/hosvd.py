"""Higher-order singular value decomposition with signs that do not hang on the machine.

Symbols follow De Lathauwer, De Moor, Vandewalle, "A multilinear singular value decomposition"
(SIAM J. Matrix Anal. 2000): a tensor A is its core S times one orthonormal matrix a mode.
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np

from service.motion.conventions import Floats
from service.motion.errors import TrainingError

# Directions that carry less than this share of the first are rounding.
NOTHING = 1e-9


@dataclass(frozen=True)
class Multilinear:
    """Core tensor (r1, r2, …) and one orthonormal basis (size of the mode, r) for each mode."""

    core: Floats
    bases: tuple[Floats, ...]

    def truncated(self, ranks: tuple[int, ...]) -> "Multilinear":
        """The leading part of every basis: the levels of one decomposition are nested.

        Squared error is at most the sum over modes of the squared singular values cut off, and at
        least the largest of these sums (property 10). Raises TrainingError for a rank that the
        decomposition does not have.
        """
        if any(not 1 <= rank <= size for rank, size in zip(ranks, self.core.shape, strict=True)):
            raise TrainingError(f"ranks {ranks}, expected 1 to {self.core.shape}")
        prefix = tuple(slice(rank) for rank in ranks)
        bases = (basis[:, :rank] for basis, rank in zip(self.bases, ranks, strict=True))
        return Multilinear(self.core[prefix], tuple(bases))

    @property
    def motions(self) -> Floats:
        """Slices along the last mode, each as a row (N, r) whose distances are theirs."""
        return self.bases[-1] * self._lengths

    def slices(self, motions: Floats) -> Floats:
        """Slices (..., B) of the tensor that rows (B, r) like `motions` stand for."""
        # Directions that carry next to nothing are rounding, and have no length to be divided by.
        lengths = self._lengths
        carried = lengths > NOTHING * lengths[0]
        worth = np.where(carried, 1.0 / np.where(carried, lengths, 1.0), 0.0)
        rest = Multilinear(self.core * worth, (*self.bases[:-1], motions))
        return rest.restored()

    @property
    def _lengths(self) -> Floats:
        """Singular values (r,) of the last mode."""
        return np.linalg.norm(unfold(self.core, self.core.ndim - 1), axis=1)

    def restored(self) -> Floats:
        """The tensor that core and bases stand for."""
        return reduce(lambda x, mb: mode_dot(x, mb[1], mb[0]), enumerate(self.bases), self.core)


def unfold(tensor: Floats, mode: int) -> Floats:
    """Mode-n unfolding: the mode's fibres as columns (size of the mode, all the rest)."""
    return np.moveaxis(tensor, mode, 0).reshape(tensor.shape[mode], -1)


def mode_dot(tensor: Floats, matrix: Floats, mode: int) -> Floats:
    """Mode-n product: matrix (rows, size of the mode) applied to every fibre of the mode.

    The tensor is never rearranged in memory, which would take longer than the product.
    """
    before, after = tensor.shape[:mode], tensor.shape[mode + 1 :]
    if not after:
        return tensor @ matrix.T
    fibres = tensor.reshape(*before, tensor.shape[mode], -1)
    return (matrix @ fibres).reshape(*before, len(matrix), *after)


def decompose(tensor: Floats) -> Multilinear:
    """HOSVD at full rank: the core is all-orthogonal, its slices ordered by their norm.

    Each basis holds the eigenvectors of its unfolding's Gram matrix, largest first; the largest
    entry of every column is positive, so the result does not hang on LAPACK's choice of sign.
    """
    return _projected(tensor, tuple(_basis(unfold(tensor, mode)) for mode in range(tensor.ndim)))


def decompose_at(tensor: Floats, ranks: tuple[int, ...]) -> Multilinear:
    """The same as `decompose` truncated, without the rest of the core: in half the time."""
    pairs = zip(range(tensor.ndim), ranks, strict=True)
    bases = tuple(_basis(unfold(tensor, mode))[:, :rank] for mode, rank in pairs)
    return _projected(tensor, bases)


def _projected(tensor: Floats, bases: tuple[Floats, ...]) -> Multilinear:
    core = reduce(lambda x, mb: mode_dot(x, mb[1].T, mb[0]), enumerate(bases), tensor)
    return Multilinear(core, bases)


def _basis(unfolded: Floats) -> Floats:
    _, vectors = np.linalg.eigh(unfolded @ unfolded.T)
    return fix_signs(vectors[:, ::-1])


def fix_signs(columns: Floats) -> Floats:
    """Columns (D, r) of either sign, turned so that the largest entry of each is positive."""
    # Rounded, so that two entries of equal size in theory do not change places by an ulp.
    largest = np.argmax(np.round(np.abs(columns), 9), axis=0)
    return columns * np.sign(columns[largest, np.arange(columns.shape[1])])


def squared_errors(core: Floats) -> Floats:
    """Exact squared error of every truncation: entry (i, j, …) is that of ranks (i+1, j+1, …).

    Orthonormal bases make it what the prefix of the core leaves out: |A|² minus a cumulative sum.
    """
    energy: Floats = np.square(core)
    for axis in range(core.ndim):
        energy = np.cumsum(energy, axis=axis)
    total = energy[(-1,) * core.ndim]
    return np.maximum(total - energy, 0.0)
