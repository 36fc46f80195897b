"""Detail of cycles: deviations of harmonics that no control predicts, sampled by a seed.

Averages over clips lose them, and with them much of a walk's acceleration (decision 0080).
"""

from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield.kriging import philox
from posefield.kriging.philox import Seeds
from posefield.model_file.model_card import ModelCard

STREAM = 3
"""Stream of a seed, besides those of `random_field`."""

Deviations = Annotated[Floats, "harmonics freedoms"]


def deviations(card: ModelCard) -> Deviations:
    """Return standard deviations (H, r1) of the harmonics' coefficients; H is 0 without detail."""
    stored = np.frombuffer(card.making.detail, dtype="<f2").astype(np.float64)
    return stored.reshape(-1, card.levels[0].ranks[0])


def to_bytes(found: Deviations) -> bytes:
    """Return the deviations as a card stores them: half precision, row by row."""
    return found.astype("<f2").tobytes()


def waves(frames: int, harmonics: int) -> Annotated[Floats, "frames waves"]:
    """Return cosines and sines (T, 2 H) of a cycle, whose last frame is its first again."""
    angles = 2.0 * np.pi * np.arange(frames)[:, None] / (frames - 1) * np.arange(1, harmonics + 1)
    return np.hstack([np.cos(angles), np.sin(angles)])


def sample(
    found: Deviations, frames: int, seed: Seeds
) -> Annotated[Floats, "*seeds frames freedoms"]:
    """Return the detail (..., T, r1) of each seed: equal for all controls and labels."""
    harmonics, freedoms = found.shape
    drawn = philox.normals(seed, STREAM, 2 * harmonics, freedoms)
    return np.asarray(waves(frames, harmonics) @ (drawn * np.vstack([found, found])))
