"""A second kriging model of the pose's leading coefficients, for the time around the event.

Averaged over a whole motion, a performer's habits outweigh the controls; at the event the controls
decide, and a model that follows their trend predicts better there. It is used only where the
leave-one-out errors of the training clips say so.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield_train.kriging import kriging_tuning
from posefield_train.kriging.kriging_tuning import TunedKriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import OTHER_STRENGTH, PRIORS, TuningProblem
from posefield_train.tensor import event_jacobian
from posefield_train.tensor.event_jacobian import COEFFICIENTS
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import EventFrame, TruncationReference

# The event's joint counts as much as all joints and frames, twice as much as in the pose's model.
EFFECTOR_GAIN = np.sqrt(2.0)
# The second model must reduce the error at the event to this share of the first's.
CLEAR_IMPROVEMENT = 0.98


@dataclass(frozen=True)
class EventErrors:
    """Root mean square leave-one-out distance of the event's joint at the event, m.

    pose: with the pose's model. event: with the second one.
    """

    pose: float
    event: float

    @property
    def is_used(self) -> bool:
        """Return True if the second model is clearly better."""
        return self.event < CLEAR_IMPROVEMENT * self.pose


def tune_event(
    nugget: float | None,
    pose: TunedKriging,
    samples: SamplePoints,
    values: Annotated[Floats, "samples modes"],
    effector: Annotated[Floats, "samples _ _"],
) -> TunedKriging:
    """Return the event's model of the motions (N, N): it has the pose's scales and a free trend.

    nugget: fixed value; None to tune it. effector: as in `TuningProblem`.
    """
    problem = TuningProblem(samples, values, nugget, EFFECTOR_GAIN * effector, OTHER_STRENGTH)
    # So large a trend leaves the slopes to the samples, as a linear drift does.
    trend = float(np.exp(PRIORS["trend"].high))
    return kriging_tuning.tune_with_trend(problem, replace(pose.hyper, trend=trend))


def compare_models(
    reference: TruncationReference,
    full: TuckerTensor,
    event: EventFrame,
    models: tuple[TunedKriging, TunedKriging],
) -> EventErrors:
    """Return the leave-one-out errors at the event of the pose's and of the event's model.

    The event's model predicts the leading coefficients alone.
    """
    pose, second = (model.residuals for model in models)
    blended = pose.copy()
    blended[:, :COEFFICIENTS] = second[:, :COEFFICIENTS]
    found = (
        event_jacobian.event_distances(reference, full, event, residuals)
        for residuals in (pose, blended)
    )
    return EventErrors(*(float(np.sqrt(np.mean(np.square(one)))) for one in found))
