"""Random fields with the covariance of a kriging model, and their conditioning on its samples.

An unconditional field is a sum of random Fourier features (Rahimi and Recht, "Random features for
large-scale kernel machines", NIPS 2007). Conditioning adds the kriging of its errors at the samples
(Matheron's rule; Chilès and Delfiner, "Geostatistics", 2012, section 7.3).
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import RATE32, RATE52, Hyper, KrigingWeights

Words = Annotated[npt.NDArray[np.uint64], "*seeds words"]
"""Numbers of 32 bits, in 64 so that products keep their upper half."""
Seeds = int | Annotated[Indices, "*seeds"]
"""One seed, or many: numbers of each are the same."""

ROUNDS = 10
MULTIPLIERS = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
KEY_STEPS = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
WORD_BITS, WORD_MASK = np.uint64(32), np.uint64(0xFFFFFFFF)
BLOCK = 4
"""Words of one counter."""
NORMAL_DECIMALS = 9
"""Decimals of normal numbers: logarithm and cosine differ between machines in the last digits."""


# NumPy's generators promise no stream across versions (NEP 19). This one is integer arithmetic
# (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 2011).
def philox(
    counters: Annotated[npt.NDArray[np.uint64], "4 blocks"],
    key: tuple[npt.ArrayLike, npt.ArrayLike],
) -> Annotated[npt.NDArray[np.uint64], "4 *keys blocks"]:
    """Return the words (4, ..., B) of counters (4, B) by Philox 4x32-10.

    key: two words, or arrays of them (..., 1).
    """
    a, b, c, d = counters
    first, second = (np.asarray(word, np.uint64) for word in key)
    for _ in range(ROUNDS):
        left, right = MULTIPLIERS[0] * a, MULTIPLIERS[1] * c
        a, c = b ^ first, d ^ second
        a ^= right >> WORD_BITS
        c ^= left >> WORD_BITS
        b, d = right & WORD_MASK, left & WORD_MASK
        first, second = (first + KEY_STEPS[0]) & WORD_MASK, (second + KEY_STEPS[1]) & WORD_MASK
    return np.stack([a, b, c, d])


def words(seed: Seeds, stream: int, count: int) -> Words:
    """Return the first words (..., count) of one of the streams of each seed."""
    blocks = -(-count // BLOCK)
    counters = np.zeros((BLOCK, blocks), dtype=np.uint64)
    counters[0], counters[1] = np.arange(blocks, dtype=np.uint64), np.uint64(stream)
    keys = np.asarray(seed, np.uint64)[..., None]
    random_words = philox(counters, (keys & WORD_MASK, keys >> WORD_BITS))
    return np.moveaxis(random_words, 0, -1).reshape(*keys.shape[:-1], -1)[..., :count]


def signs(
    seed: Seeds, stream: int, rows: int, columns: int
) -> Annotated[Floats, "*seeds rows columns"]:
    """Return random numbers (..., rows, columns), each 1 or -1, of each seed."""
    bits = words(seed, stream, rows * columns) & np.uint64(1)
    return (2.0 * bits.astype(np.float64) - 1.0).reshape(*np.shape(seed), rows, columns)


def normals(
    seed: Seeds, stream: int, rows: int, columns: int
) -> Annotated[Floats, "*seeds rows columns"]:
    """Return standard normal numbers (..., rows, columns) of one of the streams of each seed.

    By Box and Muller ("A note on the generation of random normal deviates", 1958), rounded.
    """
    pairs, shape = -(-rows * columns // 2), np.shape(seed)
    uniform = words(seed, stream, 2 * pairs).reshape(*shape, pairs, 2)
    shares = (uniform.astype(np.float64) + 0.5) / 2.0**32
    lengths, angles = np.sqrt(-2.0 * np.log(shares[..., 0])), 2.0 * np.pi * shares[..., 1]
    pairs_of_normals = np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=-1)
    numbers = pairs_of_normals.reshape(*shape, -1)[..., : rows * columns]
    return np.round(numbers, NORMAL_DECIMALS).reshape(*shape, rows, columns)


FREQUENCIES = 64
"""Random frequencies of a field. Each has a cosine and a sine, so that the variance at a point does
not depend on chance, as it would with 128 cosines of random phases.
"""
VALUE_DECIMALS = 9
"""Decimals of a conditional field: cosines and sums differ between machines in the last digits."""

SeedPoints = Annotated[Floats, "*some points coordinates"]
SeedValues = Annotated[Floats, "*seeds points values"]

SMOOTHNESS = {"exponential": (3.0, 1), "matern32": (RATE32, 3), "matern52": (RATE52, 5)}
"""Rate at unit range, and degrees of freedom of Student's distribution, of the frequencies."""
GAUSSIAN_RATE = np.sqrt(6.0)
"""Standard deviation of the frequencies of exp(-3 h²)."""

FIELD, SIGNS, NUGGETS = range(3)
"""Streams of a seed; `reduced_motion` has another one."""


def has_features(hyper: Hyper) -> bool:
    """Return whether the covariance has a distribution of frequencies to draw from."""
    return hyper.covariance == "gaussian" or hyper.covariance in SMOOTHNESS


def check_features(hyper: Hyper, take: int | str) -> None:
    """Raise InvalidField for a take of a model of which none can be drawn."""
    if not has_features(hyper):
        raise InvalidField(
            "take", f"{take!r}, but no takes can be drawn of {hyper.covariance} kriging"
        )


@dataclass(frozen=True)
class RandomField:
    """Independent Gaussian fields (m) with the covariance of kriging parameters.

    frequencies (d, K): per half-range of the controls. signs (p + sets, K), offsets (p + sets, m):
    of the names of all label sets, with one more row for each set, of a name without samples.
    common (sets, K): signs that the names of a set share. amplitudes (2 K, m): of cosines and
    sines. slopes (d, m): along the controls. Fields of many seeds have axes of the seeds before.
    """

    hyper: Hyper
    frequencies: Annotated[Floats, "*seeds controls frequencies"]
    signs: Annotated[Floats, "*seeds names frequencies"]
    common: Annotated[Floats, "*seeds sets frequencies"]
    amplitudes: Annotated[Floats, "*seeds features values"]
    offsets: Annotated[Floats, "*seeds names values"]
    slopes: Annotated[Floats, "*seeds controls values"]

    def evaluate(self, points: SeedPoints) -> SeedValues:
        """Return the values (..., B, m) at points (..., B, d + p), the controls in half-ranges."""
        d = len(self.hyper.scales)
        controls, names = points[..., :d], _with_unsampled(self.hyper, points)
        angles = controls @ self.frequencies
        scale = np.full_like(angles, FREQUENCIES**-0.5)
        sets = kriging_model.label_columns(0, _row_counts(self.hyper))
        for index, (label, rows) in enumerate(zip(self.hyper.labels, sets, strict=True)):
            common = np.sqrt(label.correlation) * self.common[..., index, None, :]
            varied = names[..., rows] @ self.signs[..., rows, :]
            scale *= common + np.sqrt(1.0 - label.correlation) * varied
        features = np.concatenate([scale * np.cos(angles), scale * np.sin(angles)], axis=-1)
        linear = names @ self.offsets + controls @ self.slopes
        return np.asarray(features @ self.amplitudes + linear)


@dataclass(frozen=True)
class ConditionalField:
    """Random deviations (m) from a kriging prediction: one smooth function of the point.

    Their mean over seeds is zero and their variance is the kriging variance, in sills. errors (n,
    m): values of the field at the samples with their nuggets. nugget (m,): that of the new
    observation, equal at all points. Fields of many seeds have axes of the seeds before.
    """

    field: RandomField
    weights: KrigingWeights
    errors: Annotated[Floats, "*seeds samples values"]
    nugget: Annotated[Floats, "*seeds values"]

    def evaluate(self, points: SeedPoints) -> SeedValues:
        """Return the deviations (..., B, m) at points (..., B, d + p)."""
        weights = self.weights.weights(points.reshape(-1, points.shape[-1]))
        kriged = weights.reshape(*points.shape[:-1], -1) @ self.errors
        values = self.field.evaluate(points) - kriged + self.nugget[..., None, :]
        return np.asarray(np.round(values, VALUE_DECIMALS))

    def evaluate_each(
        self, points: Annotated[Floats, "points coordinates"]
    ) -> Annotated[Floats, "points values"]:
        """Return the deviations (B, m) of one seed at points (B, d + p), each as it is alone.

        A product of matrices of several rows sums in another order than one of a single row; so
        each point has a product of its own.
        """
        rows = points[:, None]
        kriged = self.weights.weights(rows) @ self.errors
        values = self.field.evaluate(rows) - kriged + self.nugget
        return np.asarray(np.round(values[:, 0], VALUE_DECIMALS))


def draw_field(hyper: Hyper, seed: Seeds, count: int) -> RandomField:
    """Return independent fields (count) of a seed; ValueError without distribution of frequencies.

    Of many seeds (...), the fields of each are those that it has alone.

    A product of independent features has the product of their covariances, so that each label set
    multiplies them by signs: common ones and those of the name.
    """
    if not has_features(hyper):
        raise ValueError(f"covariance {hyper.covariance!r}, expected gaussian or {[*SMOOTHNESS]}")
    d, sets, names = len(hyper.scales), len(hyper.labels), sum(_row_counts(hyper))
    _, freedoms = SMOOTHNESS.get(hyper.covariance, (0.0, 0))
    shapes = [(d + freedoms, FREQUENCIES), *((n, count) for n in (2 * FREQUENCIES, names, d))]
    # One call for all numbers: the overhead of a call is a tenth of a field's time.
    sizes = [rows * columns for rows, columns in shapes]
    numbers = normals(seed, FIELD, 1, sum(sizes))[..., 0, :]
    blocks = zip(np.split(numbers, np.cumsum(sizes)[:-1], axis=-1), shapes, strict=True)
    spectrum, amplitudes, offsets, slopes = (
        block.reshape(*np.shape(seed), *shape) for block, shape in blocks
    )
    changes = signs(seed, SIGNS, sets + names, FREQUENCIES)
    scales = np.repeat([label.offset for label in hyper.labels], _row_counts(hyper))
    return RandomField(
        hyper,
        _frequencies(hyper, spectrum),
        changes[..., sets:, :],
        changes[..., :sets, :],
        amplitudes,
        np.sqrt(scales)[:, None] * offsets,
        np.sqrt(hyper.trend) * slopes,
    )


def simulate(weights: KrigingWeights, seed: Seeds, count: int) -> ConditionalField:
    """Return independent deviations (count) of a seed from a kriging prediction.

    Of many seeds (...), those of each are those that it has alone. Raises ValueError as
    `draw_field` does.
    """
    field, samples = draw_field(weights.hyper, seed, count), weights.samples
    nuggets = normals(seed, NUGGETS, len(samples) + 1, count)
    nuggets *= np.sqrt(weights.hyper.nugget)
    errors = field.evaluate(samples) + nuggets[..., 1:, :]
    return ConditionalField(field, weights, errors, nuggets[..., 0, :])


def _row_counts(hyper: Hyper) -> list[int]:
    """Return the number of rows of each label set: its names and one without samples."""
    return [label.count + 1 for label in hyper.labels]


def _frequencies(
    hyper: Hyper, normals: Annotated[Floats, "*seeds rows frequencies"]
) -> Annotated[Floats, "*seeds controls frequencies"]:
    """Return frequencies (..., d, K) of the covariance's spectrum, per half-range of the controls.

    normals: (..., d, K), and for Student's distribution as many more rows as it has degrees of
    freedom.
    """
    directions, lengths = np.split(normals, [len(hyper.scales)], axis=-2)
    rate = np.full(FREQUENCIES, GAUSSIAN_RATE)
    if lengths.size:
        squares = np.sum(np.square(lengths), axis=-2, keepdims=True)
        rate = SMOOTHNESS[hyper.covariance][0] / np.sqrt(squares)
    return hyper.scales[:, None] * directions * rate


def _with_unsampled(hyper: Hyper, points: SeedPoints) -> Annotated[Floats, "*some points names"]:
    """Return the weights of names with what is left of unit length, for each label set.

    It counts as a name without samples, as in `kriging_model.prior_variances`.
    """
    blocks = [np.zeros((*points.shape[:-1], 0))]
    for columns in kriging_model.label_columns(len(hyper.scales), hyper.label_counts):
        label_values = points[..., columns]
        left = np.sqrt(np.maximum(1.0 - np.sum(np.square(label_values), axis=-1), 0.0))
        blocks += [label_values, left[..., None]]
    return np.concatenate(blocks, axis=-1)
