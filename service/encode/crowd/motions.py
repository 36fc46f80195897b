"""The motions of a crowd, one after the other, as samples that USD takes."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from service.encode import facts, moves
from service.encode.animation import Animations
from service.encode.character import Rig
from service.encode.content import Content, Samples
from service.encode.convention import METRES
from service.encode.crowd import reach
from service.encode.crowd.reach import Hull
from service.encode.press import CRATES
from service.motion.conventions import Floats, Indices
from service.motion.crowd import CrowdClip, Motions


@dataclass(frozen=True)
class Note:
    """What is kept of a motion once it is written: its box (2, 3), m, and its level of detail by
    the frames from which it holds."""

    box: Floats
    levels: dict[int, int]


@dataclass(frozen=True)
class Motion:
    """Samples of translations (F, J, 3) and of rotations (F, J, 4), real part last; its note."""

    samples: Samples
    note: Note


def count(crowd: CrowdClip) -> int:
    """How many motions the characters play."""
    return int(crowd.motion.max()) + 1


def each(crowd: CrowdClip, rig: Rig) -> Iterator[Motion]:
    """The motions in order; of the batches one is held, and none while the next is made.

    Raises ValueError where there are more or fewer than the characters play, or other frames.
    """
    made, hull = 0, reach.hull(rig)
    # A loop over the batches would hold on to each until it has the next.
    for motion in chain.from_iterable(map(partial(_of, crowd, hull), crowd.batches)):
        made += 1
        yield motion
    if made != count(crowd):
        raise ValueError(f"{made} motions, expected {count(crowd)}")


def layer(rig: Rig, rate: float, samples: Samples) -> bytes:
    """Binary layer of one motion."""
    return CRATES.write(Animations(rate, METRES, rig.paths), Content(samples, {}, facts.NONE))


def _of(crowd: CrowdClip, hull: Hull, batch: Motions) -> Iterator[Motion]:
    expected = (crowd.frames, len(crowd.skeleton), 4)
    if batch.rotations.shape[1:] != expected:
        raise ValueError(f"motions of {batch.rotations.shape[1:]}, expected {expected}")
    made = moves.of_motions(batch)
    boxes = reach.boxes(hull, made)
    for part, box, levels in zip(made.parts(1), boxes, batch.levels, strict=True):
        samples = {"translations": part.translations, "rotations": part.rotations}
        yield Motion(samples, Note(box, _changes(levels)))


def _changes(levels: Indices) -> dict[int, int]:
    """Level by frame, of the first frame and of those whose level is not the frame's before."""
    changed = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1))
    return {int(frame): int(levels[frame]) for frame in changed}
