"""Compiled kernels for one pose from controls and time: posefield's and naive kriging's.

numba compiles loops in float64, written in the same style for both methods: a covariance for every
sample, then products with the rows innermost. Poses are computed one at a time; a call takes many
only to leave Python's call overhead out of the timing. All arrays are C-contiguous.
"""

from math import exp, sqrt

import numba

from posefield.common.units import Floats
from posefield.kriging.kriging_model import RATE52

compiled = numba.njit(fastmath=True)


@compiled
def basis(point: Floats, samples: Floats, scales: Floats, out: Floats) -> None:
    """Write covariances (Matérn 5/2) and linear drift (n + 1 + d,) of a point (d,).

    samples (d, n), scales (d,).
    """
    d, n = samples.shape
    out[:n] = 0.0
    for k in range(d):
        for i in range(n):
            gap = (point[k] - samples[k, i]) * scales[k]
            out[i] += gap * gap
    for i in range(n):
        out[i] = RATE52 * sqrt(out[i])
    for i in range(n):
        out[i] = (1.0 + out[i] + out[i] * out[i] / 3.0) * exp(-out[i])
    out[n] = 1.0
    for k in range(d):
        out[n + 1 + k] = point[k]


@compiled
def add_product(weights: Floats, rows: Floats, share: float, out: Floats) -> None:
    """Add share · weights (m,) @ rows (m, D) to out (D,); rows may be fewer than weights."""
    for i in range(rows.shape[0]):
        weight = share * weights[i]
        for j in range(rows.shape[1]):
            out[j] += weight * rows[i, j]


@compiled
def solve(columns: Floats, order: Floats, inverse: Floats, b: Floats, out: Floats) -> None:
    """Solve a system whose LU factors are given.

    columns (m, m): factors, column by column. order (m,): row permutation. inverse (m,): reciprocal
    diagonal.
    """
    size = len(b)
    for i in range(size):
        out[i] = b[order[i]]
    for j in range(size):
        value = out[j]
        for i in range(j + 1, size):
            out[i] -= columns[j, i] * value
    for j in range(size - 1, -1, -1):
        value = out[j] * inverse[j]
        out[j] = value
        for i in range(j):
            out[i] -= columns[j, i] * value


@compiled
def ours(points, positions, arrays, scratch, out):  # type: ignore[no-untyped-def]
    """Write pose vectors (Q, D) of the model at points (Q, d) and canonical frames (Q,)."""
    samples, scales, dual, core, table, directions, mean = arrays
    near, coefficients, motion, time = scratch
    last, r2 = table.shape[0] - 2, table.shape[1]
    r1 = len(time)
    for q in range(len(points)):
        basis(points[q], samples, scales, near)
        coefficients[:] = 0.0
        add_product(near, dual, 1.0, coefficients)
        motion[:] = 0.0
        add_product(coefficients, core, 1.0, motion)
        before = min(int(positions[q]), last)
        share = positions[q] - before
        time[:] = 0.0
        for k in range(r2):
            level = (1.0 - share) * table[before, k] + share * table[before + 1, k]
            for i in range(r1):
                time[i] += level * motion[k * r1 + i]
        out[q] = mean
        add_product(time, directions, 1.0, out[q])


@compiled
def naive_solved(points, positions, arrays, scratch, out):  # type: ignore[no-untyped-def]
    """Write pose vectors (Q, D) of naive kriging by the LU factors of each frame's system.

    A place between two frames evaluates both; a place on a frame evaluates one.
    """
    samples, scales, columns, order, inverse, values = arrays
    near, weights = scratch
    for q in range(len(points)):
        out[q] = 0.0
        first = int(positions[q])
        for frame in range(first, first + 2):
            share = 1.0 - abs(positions[q] - frame)
            if share > 0.0:
                basis(points[q], samples, scales[frame], near)
                solve(columns[frame], order[frame], inverse[frame], near, weights)
                add_product(weights, values[frame], share, out[q])


@compiled
def naive_inverted(points, positions, arrays, scratch, out):  # type: ignore[no-untyped-def]
    """Write the same with each frame's inverse (m, n) given: a product instead of a solve."""
    samples, scales, inverses, values = arrays
    near, weights = scratch
    for q in range(len(points)):
        out[q] = 0.0
        first = int(positions[q])
        for frame in range(first, first + 2):
            share = 1.0 - abs(positions[q] - frame)
            if share > 0.0:
                basis(points[q], samples, scales[frame], near)
                weights[:] = 0.0
                add_product(near, inverses[frame], 1.0, weights)
                add_product(weights, values[frame], share, out[q])


@compiled
def naive_dual(points, positions, arrays, scratch, out):  # type: ignore[no-untyped-def]
    """Write the same with inverse times samples (m, D) given: one product per frame."""
    samples, scales, duals = arrays
    (near,) = scratch
    for q in range(len(points)):
        out[q] = 0.0
        first = int(positions[q])
        for frame in range(first, first + 2):
            share = 1.0 - abs(positions[q] - frame)
            if share > 0.0:
                basis(points[q], samples, scales[frame], near)
                add_product(near, duals[frame], share, out[q])
