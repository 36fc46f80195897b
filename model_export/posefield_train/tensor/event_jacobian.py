"""Effect of a motion's coefficients on the joint of the event, at the event."""

from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerClip
from posefield.common.units import Floats
from posefield_train.tensor import truncation_error
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import EventFrame, TruncationReference

COEFFICIENTS = 15
"""Number of coefficients, the largest first, whose effect is measured."""
# Forward differences: this share of the deviation of the first coefficient.
STEP = 0.02
# Weight of the event's joint in the loss of kriging beside that of all joints and frames.
EFFECTOR_WEIGHT = 0.5


def effector_weights(
    reference: TruncationReference, full: TuckerTensor
) -> Annotated[Floats, "clips 3 _"] | None:
    """Return matrices (N, 3, m) from a clip's residuals to its weighted error at the event.

    Without an event there are none.
    """
    if reference.event_frame is None:
        return None
    measure = EFFECTOR_WEIGHT * reference.own_tensor.weight * full.bases[1].shape[0]
    return np.sqrt(measure) * event_jacobians(reference, full, reference.event_frame)


def event_jacobians(
    reference: TruncationReference, full: TuckerTensor, event: EventFrame
) -> Annotated[Floats, "clips 3 _"]:
    """Return the derivatives (N, 3, m), m per unit, of the event joint's position at each clip.

    full: untruncated tensor, whose motions (N, N) are the coefficients. m: at most COEFFICIENTS.
    """
    motions = full.motions
    count = min(COEFFICIENTS, motions.shape[1])
    step = STEP * float(motions[:, 0].std())
    start = _positions(reference, full, motions, event)
    found = np.empty((len(motions), 3, count))
    for column in range(count):
        moved = motions.copy()
        moved[:, column] += step
        found[:, :, column] = (_positions(reference, full, moved, event) - start) / step
    return found


def event_distances(
    reference: TruncationReference,
    full: TuckerTensor,
    event: EventFrame,
    residuals: Annotated[Floats, "clips _"],
) -> PerClip:
    """Return the distances (N,), m, by which residuals (N, N) of the motions move the joint."""
    captured = _positions(reference, full, full.motions, event)
    predicted = _positions(reference, full, full.motions - residuals, event)
    return np.asarray(np.linalg.norm(predicted - captured, axis=1))


def _positions(
    reference: TruncationReference, full: TuckerTensor, motions: Floats, event: EventFrame
) -> Floats:
    """Return the positions (N, 3), m, of the event's joint for coefficients (N, N)."""
    own = reference.own_tensor
    first, second, _ = full.bases
    at_event = TuckerTensor(full.core, (first, second[[event.frame]], full.bases[2]))
    values = at_event.slices(motions)
    found = truncation_error.positions(own, values, reference.parents, reference.offsets)
    return found[:, 0, event.joint]
