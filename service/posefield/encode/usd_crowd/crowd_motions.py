"""Motions of a crowd as USD samples, one at a time."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.encode.character import animation_samples
from posefield.encode.character.character import Rig
from posefield.encode.files.file_convention import METRES
from posefield.encode.usd import custom_data
from posefield.encode.usd.layer_content import Content, Samples
from posefield.encode.usd.template_cache import CRATES, Press
from posefield.encode.usd.usd_animation import Animations
from posefield.encode.usd_crowd import crowd_extent
from posefield.encode.usd_crowd.crowd_extent import Hull
from posefield.motion.crowd_clip import CrowdClip, Motions


@dataclass(frozen=True)
class Note:
    """Facts of a motion that are kept after it is written.

    box (2, 3): lowest and highest corner, m. levels: level of detail by the first frame at which it
    applies.
    """

    box: Floats
    levels: dict[int, int]


@dataclass(frozen=True)
class Motion:
    """Samples of one motion and its note.

    samples: translations (F, J, 3), and rotations (F, J, 4), real part last.
    """

    samples: Samples
    note: Note


def count(crowd: CrowdClip) -> int:
    """Return the number of motions that the characters play."""
    return int(crowd.motion.max()) + 1


def each(crowd: CrowdClip, rig: Rig) -> Iterator[Motion]:
    """Yield the motions in order; at most one batch is in memory at a time.

    Raises ValueError for a number of motions other than the characters play, and for other shapes.
    """
    made, hull = 0, crowd_extent.hull(rig)
    # The variable of a for loop would keep each batch in memory while the next is computed.
    for motion in chain.from_iterable(map(partial(_of, crowd, hull), crowd.batches)):
        made += 1
        yield motion
    if made != count(crowd):
        raise ValueError(f"{made} motions, expected {count(crowd)}")


def layer(rig: Rig, rate: float, samples: Samples, press: Press = CRATES) -> bytes:
    """Return the binary layer of one motion, written by `press`."""
    return press.write(Animations(rate, METRES, rig.paths), Content(samples, {}, custom_data.NONE))


def _of(crowd: CrowdClip, hull: Hull, batch: Motions) -> Iterator[Motion]:
    expected = (crowd.frames, len(crowd.skeleton), 4)
    if batch.rotations.shape[1:] != expected:
        raise ValueError(f"motions of {batch.rotations.shape[1:]}, expected {expected}")
    made = animation_samples.of_motions(batch)
    boxes = crowd_extent.boxes(hull, made)
    for part, box, levels in zip(made.parts(1), boxes, batch.levels, strict=True):
        samples = {"translations": part.translations, "rotations": part.rotations}
        yield Motion(samples, Note(box, _changes(levels)))


def _changes(levels: Indices) -> dict[int, int]:
    """Return the level by frame, for the first frame and each frame at which it changes."""
    changed = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1))
    return {int(frame): int(levels[frame]) for frame in changed}
