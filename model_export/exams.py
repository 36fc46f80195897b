"""How far a level's answers lie from those of the model that nothing is cut from."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from model_export import fidelity, kriging, thin
from model_export.fidelity import Moment
from model_export.hosvd import Multilinear
from model_export.model import Model
from model_export.recipe import Recipe
from model_export.train import Trained
from service.motion.conventions import Floats

# The worst pose may be off by so many times what all are on the whole: levels are chosen by it.
TAIL = 5.0


@dataclass(frozen=True)
class Errors:
    """Distances of joints, m: root mean square, 99th percentile, largest; and the largest root mean
    square over the joints of one pose."""

    rms: float
    p99: float
    max: float
    pose: float


@dataclass(frozen=True)
class Exam:
    """Random questions, and the answers of the model that nothing is cut from.

    controls (Q, d), labels (Q, p), times (Q, 1). whole (Q, J, 3): joints, m; at_event (Q, 3): the
    event's joint at its moment.
    """

    controls: Floats
    labels: Floats
    times: Floats
    parents: tuple[int, ...]
    moment: Moment | None
    whole: Floats
    at_event: Floats

    def errors(self, model: Model, level: int, joints: Sequence[int]) -> Errors:
        """Errors of a level over some joints."""
        answer = model.evaluate(self.controls, self.times, self.labels, level)
        found = answer.positions(self.parents)[:, 0]
        gaps = np.linalg.norm(found - self.whole, axis=-1)[:, list(joints)]
        poses = np.sqrt(np.mean(np.square(gaps), axis=1))
        rms = float(np.sqrt(np.mean(np.square(poses))))
        return Errors(rms, float(np.quantile(gaps, 0.99)), float(gaps.max()), float(poses.max()))

    def effector(self, model: Model, level: int) -> float | None:
        """Root mean square distance, m, of the event's joint at its event, where there is one."""
        if self.moment is None:
            return None
        found = _event(model, self, level, self.moment)
        return float(np.sqrt(np.mean(np.sum(np.square(found - self.at_event), axis=-1))))

    def keeps(self, model: Model, allowed: dict[str, float]) -> bool:
        """Whether the last level keeps what is allowed, over the joints that it moves."""
        last = len(model.decoder.coarse)
        found = vars(self.errors(model, last, model.decoder.rungs[last].joints))
        if "rms" in allowed:
            allowed = {**allowed, "pose": TAIL * allowed["rms"]}
        if "effector" in allowed:
            found = {**found, "effector": self.effector(model, last)}
        return all(found[name] <= most for name, most in allowed.items())


def of(recipe: Recipe, trained: Trained, questions: int) -> Exam:
    """Exam of a trained model's levels, of so many questions."""
    moment = fidelity.moment(recipe, trained.examples)
    whole = uncut(trained.model, trained.full)
    return against(whole, trained.skeleton.parents, moment, questions)


def against(whole: Model, parents: tuple[int, ...], moment: Moment | None, questions: int) -> Exam:
    """Exam by the answers of a model that nothing is cut from."""
    bank = whole.bank
    points, d = thin.questions(bank, 1.0, questions), len(bank.low)
    controls = (points[:, :d] * (bank.high - bank.low) + bank.high + bank.low) / 2.0
    labels = points[:, d:]
    rng = np.random.Generator(np.random.PCG64(len(points)))
    durations = whole.evaluate(controls, np.zeros((len(points), 1)), labels).duration
    times = rng.uniform(0.0, 1.0, (len(points), 1)) * durations[:, None]
    joints = whole.evaluate(controls, times, labels).positions(parents)[:, 0]
    exam = Exam(controls, labels, times, parents, moment, joints, np.zeros((len(points), 3)))
    return replace(exam, at_event=_event(whole, exam, 0, moment)) if moment else exam


def _event(model: Model, exam: Exam, level: int, moment: Moment) -> Floats:
    """Where the event's joint is (Q, 3) at its canonical frame, m."""
    place = np.full((len(exam.controls), 1), float(moment.frame))
    answer = model.posed(exam.controls, place, exam.labels, level)
    return answer.positions(exam.parents)[:, 0, moment.joint]


def uncut(model: Model, full: Multilinear) -> Model:
    """A model before its tensor was cut."""
    bank = model.bank
    pose = kriging.solve(bank.pose.hyper, bank.pose.samples, full.bases[2])
    return replace(
        model, bank=replace(bank, pose=pose), decoder=replace(model.decoder, reduced=full)
    )
