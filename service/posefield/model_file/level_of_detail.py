"""Levels of detail: the size, cost and error of each."""

from dataclasses import dataclass

from posefield.common.bounded_types import Count, Index, NonNegative


@dataclass(frozen=True)
class Level:
    """One level of detail of a model; the finest comes first, and ranks never grow after it.

    ranks: of the core tensor. samples: number of clips from which coefficients are interpolated.
    joints: indices of the moving joints; the others keep the family's mean rotation. numbers: count
    of the numbers in the file that the level reads; bytes: their size in float32. operations:
    multiply-adds of one pose. rms, p99, max: of the distances, m, between its joints and those of
    the untruncated model, over random controls, performers and times. pose: the largest root mean
    square over the joints of one pose, m. effector: root mean square of the event's joint at its
    event, m. event: number of leading coefficients with a second prediction around the event.
    """

    ranks: tuple[Count, Count, Count]
    samples: Count
    joints: tuple[Index, ...]
    numbers: Index
    bytes: Index
    operations: Index
    rms: NonNegative
    p99: NonNegative
    pose: NonNegative
    max: NonNegative
    effector: NonNegative | None
    event: Index = 0
