"""Takes: other motions for the same question, drawn about the prediction as captured clips vary.

A take is a conditional simulation of the kriged coefficients: a seed stands for one smooth function
of the controls and labels, which is zero at captured clips up to the nugget (decision 0080).
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from posefield.common.array_shapes import PointControls, PointLabels, Values
from posefield.inference.session import Session
from posefield.kriging import kriging_model, random_field
from posefield.kriging.random_field import ConditionalField
from posefield.model_file import subgraph

FIELD_CACHE, DEVIATION_CACHE = 64, 4096
"""Numbers of cached fields, of about 200 kB each, and of deviations at one point, of 300 bytes. A
crowd asks for the same points in every frame.
"""
EVENTFUL_TIMES = 3
"""Time functions of a motion without cycle that a take varies, the first ones. Residuals of further
ones are differences in footing and timing, which are no independent Gaussian numbers.
"""


@dataclass(frozen=True)
class TakeSettings:
    """Deviation of a motion from its prediction.

    seed: of the take; 0 for none. variety: its size; 1 for that of captured clips. detail: whether
    details that no control predicts are added.
    """

    seed: int
    variety: float
    detail: bool


class TakeSampler:
    """Deviations of the takes of one model."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._field_cached = lru_cache(FIELD_CACHE)(self._field)
        self._deviations_cached = lru_cache(DEVIATION_CACHE)(self._deviations)

    @property
    def is_available(self) -> bool:
        """Return whether the model's covariance can be simulated."""
        return random_field.has_features(self._session.card.kriging)

    def deviations(self, controls: PointControls, labels: PointLabels, seed: int) -> Values:
        """Return a take's deviations (m,) at controls (1, d) and labels (1, p).

        They are uncorrelated, each with the variance of sigma, m²: of the coefficients of the
        finest level, and of a cycle's duration and travel.
        """
        limited = self._session.bounds.limit(controls)
        points = kriging_model.half_ranges(limited, *self._session.card.sampled_ranges)
        return self._deviations_cached(tuple(np.hstack([points, labels])[0].tolist()), seed)

    def _deviations(self, point: tuple[float, ...], seed: int) -> Values:
        found = self._field_cached(seed).evaluate(np.array([point]))
        return np.asarray(self._root_of_sill * found[0])

    def _field(self, seed: int) -> ConditionalField:
        card = self._session.card
        count = card.levels[0].ranks[2] + len(card.beside)
        return random_field.simulate(self._session.kriging_weights, seed, count)

    @cached_property
    def _root_of_sill(self) -> float:
        sill = subgraph.initializers(self._session.content)["sill"]
        return float(np.sqrt(sill.item()))
