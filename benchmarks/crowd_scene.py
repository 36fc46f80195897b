"""Crowd around a camera: its questions and levels of detail."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.inference.level_selection import Camera, LevelCriteria
from posefield.motion.clip import CrowdPoses, Placement
from posefield.synthesis import crowd_synthesis
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.crowd_validation import CrowdQuestion

EYES = np.array([0.0, 1.6, 0.0])
CAMERA = Camera(EYES, math.radians(60.0), 1080.0)
LIMIT = 1.0
ROOM = 4.0
"""Square metres for each character."""
AUTO = LevelCriteria(CAMERA, LIMIT, None, None)
SEEN = (
    f"one character to {ROOM:g} m² around a camera at eye height, 60 degrees, 1080 pixels high, "
    f"limit {LIMIT:g} pixel"
)


@dataclass(frozen=True)
class Scene:
    """N characters at random controls (N, d) and times (N,), s, in random order around a camera."""

    model: Synthesizer
    controls: Floats
    times: Floats
    placement: Placement

    def __len__(self) -> int:
        return len(self.times)

    def poses(self, detail: Indices | LevelCriteria) -> Callable[[], CrowdPoses]:
        """Return a function that makes the crowd's placed quaternions from its controls."""
        names = (control.name for control in self.model.session.card.controls)
        question = CrowdQuestion(
            dict(zip(names, self.controls.T, strict=True)),
            self.times,
            self.placement,
            (None,),
            np.zeros(len(self), dtype=np.int64),
            detail,
            "travelling",
            "warn",
        )
        return lambda: crowd_synthesis.synthesize_crowd(self.model, question)

    @property
    def coarsest(self) -> int:
        """The last of the model's levels of detail."""
        return len(self.model.session.card.levels) - 1

    def all_at(self, level: int) -> Indices:
        """The same level (N,) for everybody."""
        return np.full(len(self), level)


def around(model: Synthesizer, count: int) -> Scene:
    """Scene of so many characters; the same at every call."""
    rng = np.random.Generator(np.random.PCG64(count))
    card_controls = model.session.card.controls
    low, high = np.array([(control.minimum, control.maximum) for control in card_controls]).T
    controls = rng.uniform(low, high, (count, len(card_controls)))
    # Nobody stands where the camera is: the ring begins a step from it.
    inner = (model.radius + 0.5) ** 2
    away = np.sqrt(rng.uniform(inner, inner + ROOM * count / np.pi, count))
    angles = rng.uniform(0.0, 2.0 * np.pi, count)
    positions = np.stack([away * np.sin(angles), np.zeros(count), away * np.cos(angles)], axis=1)
    placement = Placement(positions, rng.uniform(-np.pi, np.pi, count))
    return Scene(model, controls, rng.uniform(0.0, 1.0, count) * _ends(model, controls), placement)


def _ends(model: Synthesizer, controls: Floats) -> Floats:
    """Durations (N,), s, that every level agrees to."""
    start = np.zeros((len(controls), 1))
    levels = range(len(model.session.card.levels))
    end_points = [
        model.session.run(controls, start, "duration", level=level)[0] for level in levels
    ]
    return np.min(end_points, axis=0).astype(float)


def mix(levels: Indices, count: int) -> str:
    """Share of the characters at each of so many levels, the finest first, in words."""
    shares = 100.0 * np.bincount(levels, minlength=count) / len(levels)
    return " / ".join(f"{share:.0f}" for share in shares) + " % at levels, the finest first"
