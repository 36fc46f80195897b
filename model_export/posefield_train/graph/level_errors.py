"""Errors of a level of detail relative to the model before truncation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield_train.graph.float_model import FloatModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_kriging, thinning
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import event_blend, truncation_error
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import EventFrame

# Largest ratio of the worst pose's error to the allowed root mean square, when a level is chosen.
TAIL_RATIO = 5.0


@dataclass(frozen=True)
class LevelErrors:
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
class LevelTest:
    """Random test inputs with the output of the model before truncation.

    controls: (Q, d). labels: (Q, p). times: (Q, 1), s. whole: joint positions (Q, J, 3), m, and
    points of the curves behind them. at_event: position (Q, 3) of the event's joint at the event,
    m.
    """

    controls: Floats
    labels: Floats
    times: Floats
    parents: tuple[int, ...]
    moment: EventFrame | None
    whole: Floats
    at_event: Floats

    def outputs(self, model: FloatModel, level: int) -> "LevelOutputs":
        """Return a level's outputs at the test inputs."""
        return LevelOutputs(self, model, level, model.fields(self.controls, self.labels, level))

    def keeps(self, model: FloatModel, allowed: dict[str, float]) -> bool:
        """Return True if the last level stays within the allowed errors over its moving joints.

        allowed: errors, m, by name in `LevelErrors`, and of the effector.
        """
        last = len(model.decoder.coarse)
        answers = self.outputs(model, last)
        found = answers.errors(model.decoder.level_sizes[last].joints)
        if "rms" in allowed and found.pose > TAIL_RATIO * allowed["rms"]:
            return False
        joints = {name: most for name, most in allowed.items() if name != "effector"}
        if any(getattr(found, name) > most for name, most in joints.items()):
            return False
        effector = answers.effector if "effector" in allowed else None
        return effector is None or effector <= allowed["effector"]


@dataclass(frozen=True)
class LevelOutputs:
    """Outputs of a level at the test inputs. fields: kriged values (Q, m) by name."""

    test: LevelTest
    model: FloatModel
    level: int
    fields: dict[str, Floats]

    def errors(self, joints: Sequence[int]) -> LevelErrors:
        """Return the errors over some joints and all curves."""
        found = self.model.outputs_at_times(self.fields, self.test.times, self.level)
        points = found.points(self.test.parents, self.model.decoder.curves)[:, 0]
        gaps = np.linalg.norm(points - self.test.whole, axis=-1)
        return LevelErrors(gaps[:, [*joints, *range(len(self.test.parents), gaps.shape[1])]])

    @property
    def effector(self) -> float | None:
        """Return the RMS distance, m, of the event's joint at the event; None without event."""
        exam = self.test
        if exam.moment is None:
            return None
        found = _event_positions(self.model, self.fields, self.level, exam.moment, exam.parents)
        return float(np.sqrt(np.mean(np.sum(np.square(found - exam.at_event), axis=-1))))


def level_test(recipe: Recipe, trained: TrainedModel, questions: int) -> LevelTest:
    """Return an exam of a trained model's levels with the given number of inputs."""
    moment = truncation_error.event_frame(recipe, trained.examples)
    whole = untruncated(trained.model, trained.full, trained.samples)
    return level_test_against(whole, trained.skeleton.parents, moment, questions)


def level_test_against(
    whole: FloatModel, parents: tuple[int, ...], moment: EventFrame | None, questions: int
) -> LevelTest:
    """Return an exam with outputs of a model before truncation."""
    bank = whole.bank
    points, d = thinning.random_points(bank, 1.0, questions), len(bank.low)
    controls = (points[:, :d] * (bank.high - bank.low) + bank.high + bank.low) / 2.0
    labels = points[:, d:]
    rng = np.random.Generator(np.random.PCG64(len(points)))
    fields = whole.fields(controls, labels, 0)
    times = rng.uniform(0.0, 1.0, (len(points), 1)) * np.exp(fields["duration"])
    joints = whole.outputs_at_times(fields, times, 0).points(parents, whole.decoder.curves)[:, 0]
    event = (
        _event_positions(whole, fields, 0, moment, parents)
        if moment
        else np.zeros((len(points), 3))
    )
    return LevelTest(controls, labels, times, parents, moment, joints, event)


def _event_positions(
    model: FloatModel,
    fields: dict[str, Floats],
    level: int,
    moment: EventFrame,
    parents: tuple[int, ...],
) -> Floats:
    """Return positions (Q, 3), m, of the event's joint at its canonical frame."""
    chain = skeleton.joint_chain(parents, moment.joint)
    return model.joint_at_frame(fields, chain, moment.frame, level)


def untruncated(model: FloatModel, full: TuckerTensor, samples: SamplePoints) -> FloatModel:
    """Return the model with the tensor before truncation. samples: of the tensor's clips."""
    bank = model.bank
    pose = sample_kriging.solve(bank.pose.hyper, samples, full.bases[2])
    decoder = replace(model.decoder, reduced=full)
    event, blend = bank.event, model.decoder.event
    if event and blend:
        whole = event_blend.build_blend(blend.count, blend.weights, full.core, full.bases[1])
        decoder = replace(decoder, event=whole)
        event = sample_kriging.solve(event.hyper, samples, full.bases[2][:, : whole.count])
    return replace(model, bank=replace(bank, pose=pose, event=event), decoder=decoder)
