"""Levels of detail: what each costs, and how far its answers lie from those of the whole model."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Level:
    """One level of detail of a model; the finest comes first, and ranks never grow after it.

    ranks: of the core tensor. samples: so many of the clips are asked. joints: indices of those
    that move; the others keep the family's mean rotation. numbers: what the level reads of the
    file; bytes: the same in float32. operations: multiply-adds of one pose. rms, p99, max: of the
    distances, m, between its joints and those of the model that nothing is cut from, over random
    controls, performers and times. pose: the largest root mean square over the joints of one pose,
    m. effector: root mean square of the event's joint at its event, m.
    """

    ranks: tuple[int, int, int]
    samples: int
    joints: tuple[int, ...]
    numbers: int
    bytes: int
    operations: int
    rms: float
    p99: float
    pose: float
    max: float
    effector: float | None
