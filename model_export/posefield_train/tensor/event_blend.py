"""Blend of a motion's coefficients, around its event, into those of another prediction.

Around the event a second prediction of the leading coefficients replaces the first, with a weight
that falls with the distance in time. Since motions are linear in the coefficients, the blend is a
further block of the core over further columns of the time basis: the graph needs no other step.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Frames, PerClip
from posefield_train.tensor import truncation_error
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import EventFrame, TruncationReference

# Width of the blend: standard deviation of the weight, as a share of a clip.
WIDTH = 7 / 60
# Share of the squared weighted time basis that its approximation may lose.
LOST_SHARE = 1e-3


@dataclass(frozen=True)
class EventBlend:
    """Weighted time basis of the event, as a product of two small matrices.

    count: number of leading coefficients that have a second prediction. weights: (T,), from 0 to 1
    at the event. times: (T, q) and mixing: (r2, q); their product approximates the weighted time
    basis.
    """

    count: int
    weights: Frames
    times: Annotated[Floats, "frames columns"]
    mixing: Annotated[Floats, "times columns"]

    def core(
        self, core: Annotated[Floats, "freedoms times modes"]
    ) -> Annotated[Floats, "freedoms more_times more_modes"]:
        """Return the core (r1, r2 + q, r3 + count) with the blend's block in its last corner."""
        r1, r2, r3 = core.shape
        columns = self.mixing.shape[1]
        found = np.zeros((r1, r2 + columns, r3 + self.count))
        found[:, :r2, :r3] = core
        block = np.tensordot(core[:, :, : self.count], self.mixing, axes=(1, 0))
        found[:, r2:, r3:] = block.swapaxes(1, 2)
        return found


def event_weights(frames: int, event: int, cyclic: bool) -> Frames:
    """Return the blend's weights (T,) of canonical frames, for an event at one of them."""
    apart = np.abs(np.arange(frames) - event) / (frames - 1)
    if cyclic:
        apart = np.minimum(apart, 1.0 - apart)
    return np.exp(-0.5 * np.square(apart / WIDTH))


def build_blend(
    count: int,
    weights: Frames,
    core: Annotated[Floats, "freedoms times modes"],
    basis: Annotated[Floats, "frames times"],
) -> EventBlend:
    """Return the blend of at most `count` leading coefficients of a reduced tensor.

    core: (r1, r2, r3). basis: time basis (T, r2).
    """
    lengths = np.linalg.norm(np.moveaxis(core, 1, 0).reshape(core.shape[1], -1), axis=1)
    carried = np.maximum(lengths, 1e-9 * lengths.max())
    left, values, right = np.linalg.svd(weights[:, None] * basis * carried, full_matrices=False)
    lost = np.cumsum(np.square(values)[::-1])[::-1]
    columns = max(1, int(np.count_nonzero(lost > LOST_SHARE * lost[0])))
    signs = np.where(np.sum(left[:, :columns], axis=0) < 0.0, -1.0, 1.0)
    times = left[:, :columns] * values[:columns] * signs
    return EventBlend(
        min(count, core.shape[2]), weights, times, (right[:columns].T * signs) / carried[:, None]
    )


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
