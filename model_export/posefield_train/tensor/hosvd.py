"""Higher-order singular value decomposition with deterministic signs.

Symbols follow De Lathauwer, De Moor, Vandewalle, "A multilinear singular value decomposition" (SIAM
J. Matrix Anal. 2000): a tensor A is its core S times one orthonormal matrix per mode. Mukai &
Kuriyama 2006, section 2, apply it to the motion tensor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Annotated

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield_train.source import canonical

# Directions with less than this share of the first singular value are rounding errors.
RELATIVE_ZERO = 1e-9


@dataclass(frozen=True)
class TuckerTensor:
    """Core tensor (r1, r2, …) and one orthonormal basis (size of the mode, r) for each mode."""

    core: Floats
    bases: tuple[Floats, ...]

    def truncated(self, ranks: tuple[int, ...]) -> "TuckerTensor":
        """Return the decomposition cut to the leading columns of every basis.

        The squared error is at most the sum over modes of the squared singular values cut off, and
        at least the largest of these sums (De Lathauwer et al. 2000, property 10). Raises
        TrainingError for a rank beyond the decomposition's.
        """
        if any(not 1 <= rank <= size for rank, size in zip(ranks, self.core.shape, strict=True)):
            raise TrainingError(f"ranks {ranks}, expected 1 to {self.core.shape}")
        prefix = tuple(slice(rank) for rank in ranks)
        bases = (basis[:, :rank] for basis, rank in zip(self.bases, ranks, strict=True))
        return TuckerTensor(self.core[prefix], tuple(bases))

    @property
    def motions(self) -> Annotated[Floats, "samples modes"]:
        """Return the slices along the last mode as rows (N, r) with equal distances."""
        return self.bases[-1] * self._lengths

    def slices(
        self, motions: Annotated[Floats, "samples modes"]
    ) -> Annotated[Floats, "... samples"]:
        """Return the slices (..., B) of the tensor for rows (B, r) of coordinates as `motions`."""
        # Directions with tiny singular values are rounding errors; do not divide by these.
        lengths = self._lengths
        carried = lengths > RELATIVE_ZERO * lengths[0]
        worth = np.where(carried, 1.0 / np.where(carried, lengths, 1.0), 0.0)
        rest = TuckerTensor(self.core * worth, (*self.bases[:-1], motions))
        return rest.restored()

    @property
    def _lengths(self) -> Annotated[Floats, "modes"]:
        """Return the singular values (r,) of the last mode."""
        return np.linalg.norm(unfold(self.core, self.core.ndim - 1), axis=1)

    def restored(self) -> Floats:
        """Return the tensor: the core multiplied by all bases."""
        return reduce(lambda x, mb: mode_dot(x, mb[1], mb[0]), enumerate(self.bases), self.core)


def unfold(tensor: Floats, mode: int) -> Annotated[Floats, "size rest"]:
    """Return the mode-n unfolding: the mode's fibres as columns (size of the mode, rest)."""
    return np.moveaxis(tensor, mode, 0).reshape(tensor.shape[mode], -1)


def mode_dot(tensor: Floats, matrix: Annotated[Floats, "rows size"], mode: int) -> Floats:
    """Return the mode-n product: matrix (rows, size of the mode) applied to every fibre.

    The tensor is not rearranged in memory, which would take longer than the product.
    """
    before, after = tensor.shape[:mode], tensor.shape[mode + 1 :]
    if not after:
        return tensor @ matrix.T
    fibres = tensor.reshape(*before, tensor.shape[mode], -1)
    return (matrix @ fibres).reshape(*before, len(matrix), *after)


def decompose(tensor: Floats) -> TuckerTensor:
    """Return the HOSVD at full rank, with an all-orthogonal core and slices ordered by norm.

    Each basis holds the eigenvectors of its unfolding's Gram matrix, largest first; the largest
    entry of every column is positive, so the result does not depend on LAPACK's choice of sign.
    """
    bases = tuple(_basis(unfold(tensor, mode)) for mode in range(tensor.ndim))
    return TuckerTensor(_projected(tensor, bases), bases)


def decompose_in_passes(
    tensor: Annotated[Floats, "varying frames clips"], squared_error: float
) -> TuckerTensor:
    """Return the HOSVD of many clips, whose bases leave out next to nothing.

    Gram matrices of the first two modes add up over blocks of clips, and the last mode is
    decomposed after the first two are projected, as by Vannieuwenhoven et al. 2012 (ST-HOSVD), so
    that no matrix of all clips by all clips is made. squared_error: that each of the three
    projections may add, summed over the tensor.
    """
    blocks = canonical.clip_blocks(tensor.shape[2])
    bases = []
    for mode in (0, 1):
        gram = sum(_gram(unfold(tensor[:, :, block], mode)) for block in blocks)
        sizes, vectors = np.linalg.eigh(np.asarray(gram))
        first = _negligible(np.maximum(sizes, 0.0), squared_error)
        bases.append(fix_signs(vectors[:, first:][:, ::-1]))
    projections = [_projected(tensor[:, :, block], bases) for block in blocks]
    some = projections[0] if len(projections) == 1 else np.concatenate(projections, axis=2)
    left, lengths, _ = np.linalg.svd(unfold(some, 2), full_matrices=False)
    rank = len(lengths) - _negligible(np.square(lengths[::-1]), squared_error)
    last = fix_signs(left[:, :rank])
    return TuckerTensor(some @ last, (*bases, last))


def _negligible(sizes: Annotated[Floats, "size"], squared_error: float) -> int:
    """Return how many of increasing squared sizes add up to at most an error; never all."""
    left_out = np.cumsum(sizes)
    return min(int(np.searchsorted(left_out, squared_error, side="right")), len(sizes) - 1)


def _projected(tensor: Floats, bases: Sequence[Floats]) -> Floats:
    return reduce(lambda x, mb: mode_dot(x, mb[1].T, mb[0]), enumerate(bases), tensor)


def _basis(unfolded: Annotated[Floats, "size rest"]) -> Annotated[Floats, "size rank"]:
    _, vectors = np.linalg.eigh(_gram(unfolded))
    return fix_signs(vectors[:, ::-1])


def _gram(unfolded: Annotated[Floats, "size rest"]) -> Annotated[Floats, "size size"]:
    return unfolded @ unfolded.T


def fix_signs(columns: Annotated[Floats, "size rank"]) -> Annotated[Floats, "size rank"]:
    """Return columns (D, r) with signs such that the largest entry of each is positive."""
    # Rounded, so that rounding errors do not decide between two entries of equal size.
    largest = np.argmax(np.round(np.abs(columns), 9), axis=0)
    return columns * np.sign(columns[largest, np.arange(columns.shape[1])])


def squared_errors(core: Annotated[Floats, "*ranks"]) -> Annotated[Floats, "*ranks"]:
    """Return the exact squared error of every truncation: entry (i, j, …) for ranks (i+1, j+1, …).

    The bases are orthonormal, so the error is the squared norm of the core outside its prefix: |A|²
    minus a cumulative sum.
    """
    energy: Floats = np.square(core)
    for axis in range(core.ndim):
        energy = np.cumsum(energy, axis=axis)
    total = energy[(-1,) * core.ndim]
    return np.maximum(total - energy, 0.0)
