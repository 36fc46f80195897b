"""A predicted motion, and the constraint solver for it."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.constraints import gauss_newton
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.constraint import PositionConstraint
from posefield.constraints.gauss_newton import LevelCorrector
from posefield.inference.session import Session
from posefield.motion.measures import Measure


@dataclass(frozen=True)
class Begun:
    """An open model, the bench of its finest level, and a motion of it."""

    opened: Session
    bench: LevelCorrector
    held: ConstrainedMotion

    def joint(self, name) -> int:
        return self.opened.card.skeleton.names.index(name)

    def solve(self, held, aims) -> ConstrainedMotion:
        """Return the nearest motion that satisfies constraints."""
        (found,) = self.bench.solve_all([(held, aims)])
        return found

    def place(self, name, frame, by=(0.0, 0.0, 0.0)) -> PositionConstraint:
        """Return a constraint that moves a joint by `by` at a frame, m."""
        joint = self.joint(name)
        at, _ = self.held.scene.position_and_gradient(self.held.numbers, joint, frame)
        moment = Measure("height", (joint,), "landmark")
        return PositionConstraint((name,), moment, (0, 1, 2), at + np.array(by), frame)


def begin(opened: Session, level: int = 0) -> Begun:
    """A motion in the middle of the controls, of the first performer."""
    bench = gauss_newton.build_corrector(opened, level)
    point = np.median(opened.card.examples, axis=0, keepdims=True)
    performers = len(opened.card.performers)
    state = opened.state(point, np.array([0.0, 0.3, 0.61]), np.eye(1, performers), level)
    return Begun(opened, bench, bench.predict(state))


def covariance(begun: Begun) -> Floats:
    """The metric of corrections in full."""
    own = begun.bench.spread
    eye = np.eye(begun.held.scene.numbers)
    return own.apply_shrunk(eye)
