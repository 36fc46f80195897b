"""Constrained motions: predictions and their nearest motions that satisfy constraints."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.motion import measure, travelling
from service.motion.answer import Met
from service.motion.card import ModelCard
from service.motion.conventions import Floats
from service.motion.measure import Seen
from service.synthesis import freeze
from service.synthesis.exact import aims as looking
from service.synthesis.exact import feet, meet, reduced, spread
from service.synthesis.exact.aims import Aim, Place
from service.synthesis.exact.reduced import Reduced
from service.synthesis.exact.scene import Scene
from service.synthesis.exact.spread import Spread
from service.synthesis.session import Session, State


@dataclass(frozen=True)
class Held:
    """A motion, predicted or corrected.

    numbers: the motion as the variables of the correction. state: the model's prediction. met:
    error of each constraint. steps: of the correction. distance: Mahalanobis distance of the
    constraints from the prediction.
    """

    scene: Scene
    numbers: Floats
    state: State
    met: tuple[Met, ...]
    steps: int = 0
    distance: float = 0.0

    @property
    def duration(self) -> float:
        """Duration of the clip, s."""
        return float(np.exp(self.scene.beside(self.numbers)[0])) * self._given

    @property
    def _given(self) -> float:
        # Motions without cycles keep the predicted duration.
        return 1.0 if self.scene.cyclic else self.state.duration

    @property
    def travel(self) -> Floats:
        """Travel of a whole cycle (3,): to the left and ahead, m, and change of heading, rad."""
        return self.scene.beside(self.numbers)[1]

    def poses(self, frames: Floats) -> tuple[Floats, Floats]:
        """Return rotations (S, J, 4) and root positions (S, 3), m, at canonical frames (S,)."""
        scene = self.scene
        rotations, roots = scene.reduced.poses(scene.motion(self.numbers), frames)
        if not scene.cyclic:
            return rotations, roots
        share = frames / (scene.reduced.frames - 1)
        return travelling.put_back(rotations, roots, share[:, None] * self.travel)


@dataclass(frozen=True)
class Bench:
    """Data for corrections at one level of a model, computed once.

    reduced: reduced tensor. spread: covariance of the residuals of captured motions.
    """

    card: ModelCard
    reduced: Reduced
    spread: Spread

    def begun(self, state: State) -> Held:
        """Return the predicted motion, without constraints."""
        scene = Scene(self.reduced, self.card.skeleton.parents, state.bones, self.card.cyclic)
        inner = self.reduced.motion(state.coefficients).ravel()
        beside = [np.log(state.duration), *state.way] if self.card.cyclic else []
        return Held(scene, np.concatenate([inner, beside]), state, ())

    def held(self, begun: Held, aims: Sequence[Aim], pins: Sequence[Aim] = ()) -> Held:
        """Return the nearest motion that satisfies the constraints; pins are soft."""
        sigma, numbers = begun.state.sigma, begun.numbers
        found = meet.meet(begun.scene, self.spread, sigma, numbers, aims, pins)
        return Held(begun.scene, found.numbers, begun.state, found.met, found.steps, found.distance)

    def distance(self, begun: Held, aims: Sequence[Aim]) -> float:
        """Return the Mahalanobis distance of the constraints from a predicted motion."""
        return meet.distance(begun.scene, self.spread, begun.state.sigma, begun.numbers, aims)

    def pins(self, begun: Held) -> list[Place]:
        """Return the pins for the feet of a predicted motion."""
        return feet.pins(begun.scene, begun.numbers, self.card.feet)

    def measured(self, held: Held) -> dict[str, float]:
        """Return the values of the card's measured controls on a motion."""
        asked = [(c.name, c.measure, 0.0) for c in self.card.controls if c.measure]
        moving = [(name, own, goal) for name, own, goal in asked if not own.bodily]
        found = dict[str, float]()
        for aim in looking.of_controls(moving, self.reduced.frames):
            values, _ = aim.look(held.scene, held.numbers)
            found |= dict(zip(aim.names, map(float, values), strict=True))
        seen = _body(held.scene)
        found |= {name: measure.value(own, seen) for name, own, _ in asked if own.bodily}
        return {
            control.name: found[control.name]
            for control in self.card.controls
            if control.name in found
        }


def bench(session: Session, level: int) -> Bench:
    """Return the data for corrections at a level."""
    weights = freeze.weights(session.content)
    own = reduced.read(weights, session.card.levels[level])
    return Bench(session.card, own, spread.of(session.card, weights, session.weigher.samples, own))


def _body(scene: Scene) -> Seen:
    still = np.zeros((1, len(scene.parents), 3))
    return Seen(still, 0.0, np.zeros(3), scene.parents, scene.bones)
