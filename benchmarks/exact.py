"""Cost of constraining an answer to a target: a clip and a pose, beside the predicted ones."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from family import Family
from rows import Row
from timing import in_turn

from posefield.constraints import gauss_newton
from posefield.constraints.constraint import PositionConstraint
from posefield.constraints.gauss_newton import LevelCorrector
from posefield.inference import session
from posefield.inference.onnx_runtime import OUTPUTS
from posefield.inference.session import PredictionState, Session
from posefield.motion.measures import Measure

FRAMES, TARGETS = 100, 64
# A hand that ends some way from where the model puts it, m; a captured one may.
OFF = 0.02


@dataclass(frozen=True)
class Asked:
    """An open model, a question to it, and targets of a hand at the end."""

    opened: Session
    corrector: LevelCorrector
    point: np.ndarray
    times: np.ndarray
    targets: tuple[PositionConstraint, ...]

    def state(self, frames: int) -> PredictionState:
        """Return the prediction state of some frames."""
        return self.opened.state(self.point, self.times[-frames:])

    def plain(self, frames: int) -> Callable[[], object]:
        """Poses as predicted."""
        return lambda: self.opened.run(self.point, self.times[None, -frames:], *OUTPUTS)

    def exact(self, frames: int) -> Callable[[], object]:
        """Return a function that poses with the next target."""
        target = cycle(self.targets)

        def run() -> object:
            state = self.state(frames)
            predicted = self.corrector.predict(state)
            (corrected,) = self.corrector.solve_all([(predicted, [next(target)])])
            return corrected.poses(state.frames)

        return run


def rows(trained_family: Family) -> list[Row]:
    """Compare a clip and a pose constrained to a target with each other and plain ones."""
    questions = _asked(trained_family)
    runs = {
        "plain clip": questions.plain(FRAMES),
        "exact clip": questions.exact(FRAMES),
        "plain pose": questions.plain(1),
        "exact pose": questions.exact(1),
    }
    timings = in_turn(runs, rounds=15, repeats=TARGETS)
    clip, pose = timings["exact clip"], timings["exact pose"]
    words = "the same as the model predicts it, one call of the graph"
    return [
        Row(f"exact clip of {FRAMES} frames, in process", 1e3 * clip, "ms", "", None, 2.5),
        Row("its cost", clip / timings["plain clip"], "times", words, None, None),
        Row("its cost", clip / pose, "times", "an exact pose, in process", None, None),
        Row("cost of an exact pose", pose / timings["plain pose"], "times", words, None, None),
    ]


def _asked(trained_family: Family) -> Asked:
    opened = session.open_bytes(trained_family.exported.content, "reaching.onnx")
    corrector, point = (
        gauss_newton.build_corrector(opened, 0),
        trained_family.examples[4].controls[None],
    )
    times = np.linspace(0.0, float(opened.run(point, None, "duration")[0][0]), FRAMES)
    predicted = corrector.predict(opened.state(point, times))
    joint, last = opened.card.skeleton.names.index("RightHand"), float(opened.card.frames - 1)
    hand, _ = predicted.scene.position_and_gradient(predicted.numbers, joint, last)
    ways = np.random.Generator(np.random.PCG64(TARGETS)).standard_normal((TARGETS, 3))
    ways *= OFF / np.linalg.norm(ways, axis=1, keepdims=True)
    moment = Measure("height", (joint,), "end")
    targets = (PositionConstraint(("hand",), moment, (0, 1, 2), hand + offset) for offset in ways)
    return Asked(opened, corrector, point, times, tuple(targets))
