"""Made-up passages of a character with two legs, for tests of joins."""

import numpy as np

from posefield.feet import footsteps
from posefield.motion import quat
from posefield.performance.passage import RATE, Passage

# A trunk with two legs (hip, knee, ankle) and a head.
PARENTS = (-1, 0, 1, 2, 0, 4, 5, 0)
LEG = np.array([[0.1, 0.0, 0.0], [0.0, -0.4, 0.05], [0.0, -0.4, -0.05]])
BONES = np.array([[0.0, 0.0, 0.0], *LEG, *(LEG * [-1.0, 1.0, 1.0]), [0.0, 0.5, 0.0]])
FEET = (3, 6)


def character():
    """Return the character."""
    return footsteps.choose_limbs(PARENTS, BONES, FEET, ())[0]


def smooth(seed, frames=60, size=0.3, speed=1.0):
    """Return a passage of random smooth motion that goes ahead."""
    rng = np.random.default_rng(seed)
    times = np.arange(frames) / RATE
    waves = rng.normal(size=(3, len(PARENTS), 3)) * size
    bent = sum(
        wave * np.sin((order + 1.0) * times[:, None, None] * 2.0 + order)
        for order, wave in enumerate(waves)
    )
    roots = np.stack([0.02 * np.sin(4 * times), 0.8 + 0.02 * np.cos(5 * times), speed * times], 1)
    contacts = (rng.random((frames, len(FEET))) > 0.5).astype(float)
    return Passage(quat.exp(np.asarray(bent)), roots, contacts, np.full(frames, 0.03))
