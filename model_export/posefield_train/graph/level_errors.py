"""Errors of a level of detail relative to the model before truncation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield_train.graph.float_model import Model
from posefield_train.graph.trained_model import Trained
from posefield_train.kriging import thinning, universal_kriging
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import truncation_error
from posefield_train.tensor.hosvd import Multilinear
from posefield_train.tensor.truncation_error import Moment

# Largest ratio of the worst pose's error to the allowed root mean square, when a level is chosen.
TAIL = 5.0


@dataclass(frozen=True)
class Errors:
    """Errors of joints relative to the model before truncation; statistics are computed on access.

    gaps: distances (Q, J), m.
    """

    gaps: Floats

    @property
    def rms(self) -> float:
        """Return the root mean square, m."""
        return float(np.sqrt(np.mean(np.square(self._poses))))

    @property
    def p99(self) -> float:
        """Return the 99th percentile, m."""
        return float(np.quantile(self.gaps, 0.99))

    @property
    def max(self) -> float:
        """Return the largest distance, m."""
        return float(self.gaps.max())

    @property
    def pose(self) -> float:
        """Return the largest root mean square over the joints of one pose, m."""
        return float(self._poses.max())

    @cached_property
    def _poses(self) -> Floats:
        return np.sqrt(np.mean(np.square(self.gaps), axis=1))


@dataclass(frozen=True)
class Exam:
    """Random test inputs with the output of the model before truncation.

    controls: (Q, d). labels: (Q, p). times: (Q, 1), s. whole: joint positions (Q, J, 3), m.
    at_event: position (Q, 3) of the event's joint at the event, m.
    """

    controls: Floats
    labels: Floats
    times: Floats
    parents: tuple[int, ...]
    moment: Moment | None
    whole: Floats
    at_event: Floats

    def answers(self, model: Model, level: int) -> "Answers":
        """Return a level's outputs at the test inputs."""
        return Answers(self, model, level, model.fields(self.controls, self.labels, level))

    def keeps(self, model: Model, allowed: dict[str, float]) -> bool:
        """Return True if the last level stays within the allowed errors over its moving joints.

        allowed: errors, m, by name in `Errors`, and of the effector.
        """
        last = len(model.decoder.coarse)
        answers = self.answers(model, last)
        found = answers.errors(model.decoder.rungs[last].joints)
        if "rms" in allowed and found.pose > TAIL * allowed["rms"]:
            return False
        joints = {name: most for name, most in allowed.items() if name != "effector"}
        if any(getattr(found, name) > most for name, most in joints.items()):
            return False
        effector = answers.effector if "effector" in allowed else None
        return effector is None or effector <= allowed["effector"]


@dataclass(frozen=True)
class Answers:
    """Outputs of a level at the test inputs. fields: kriged values (Q, m) by name."""

    exam: Exam
    model: Model
    level: int
    fields: dict[str, Floats]

    def errors(self, joints: Sequence[int]) -> Errors:
        """Return the errors over some joints."""
        found = self.model.timed(self.fields, self.exam.times, self.level)
        gaps = np.linalg.norm(found.positions(self.exam.parents)[:, 0] - self.exam.whole, axis=-1)
        return Errors(gaps[:, list(joints)])

    @property
    def effector(self) -> float | None:
        """Return the RMS distance, m, of the event's joint at the event; None without event."""
        exam = self.exam
        if exam.moment is None:
            return None
        found = _event(self.model, self.fields, self.level, exam.moment, exam.parents)
        return float(np.sqrt(np.mean(np.sum(np.square(found - exam.at_event), axis=-1))))


def of(recipe: Recipe, trained: Trained, questions: int) -> Exam:
    """Return an exam of a trained model's levels with the given number of inputs."""
    moment = truncation_error.moment(recipe, trained.examples)
    whole = uncut(trained.model, trained.full)
    return against(whole, trained.skeleton.parents, moment, questions)


def against(whole: Model, parents: tuple[int, ...], moment: Moment | None, questions: int) -> Exam:
    """Return an exam with outputs of a model before truncation."""
    bank = whole.bank
    points, d = thinning.questions(bank, 1.0, questions), len(bank.low)
    controls = (points[:, :d] * (bank.high - bank.low) + bank.high + bank.low) / 2.0
    labels = points[:, d:]
    rng = np.random.Generator(np.random.PCG64(len(points)))
    fields = whole.fields(controls, labels, 0)
    times = rng.uniform(0.0, 1.0, (len(points), 1)) * np.exp(fields["duration"])
    joints = whole.timed(fields, times, 0).positions(parents)[:, 0]
    event = _event(whole, fields, 0, moment, parents) if moment else np.zeros((len(points), 3))
    return Exam(controls, labels, times, parents, moment, joints, event)


def _event(
    model: Model,
    fields: dict[str, Floats],
    level: int,
    moment: Moment,
    parents: tuple[int, ...],
) -> Floats:
    """Return positions (Q, 3), m, of the event's joint at its canonical frame."""
    chain = skeleton.chain(parents, moment.joint)
    return model.joint_at_frame(fields, chain, moment.frame, level)


def uncut(model: Model, full: Multilinear) -> Model:
    """Return the model with the tensor before truncation."""
    bank = model.bank
    pose = universal_kriging.solve(bank.pose.hyper, bank.pose.samples, full.bases[2])
    return replace(
        model, bank=replace(bank, pose=pose), decoder=replace(model.decoder, reduced=full)
    )
