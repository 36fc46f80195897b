"""Motions of a crowd as USD samples, one at a time."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from posefield.common.units import Floats, Indices, Singles
from posefield.encode.character import animation_samples
from posefield.encode.character.character import CharacterRig
from posefield.encode.files.file_convention import METRES
from posefield.encode.usd.usd_animation import AnimationLayerBuilder
from posefield.encode.usd_crowd import crowd_extent
from posefield.encode.usd_layers import crate_template
from posefield.encode.usd_layers.layer_content import WEIGHTS, LayerContent, Samples
from posefield.motion.crowd_clip import CrowdClip, Motions


@dataclass(frozen=True)
class MotionSummary:
    """Facts of a motion that are kept after it is written.

    box (2, 3): lowest and highest corner, m. levels: level of detail by the first frame at which it
    applies.
    """

    box: Floats
    levels: dict[int, int]


@dataclass(frozen=True)
class MotionSamples:
    """Samples of one motion and its note.

    samples: translations (F, J, 3), rotations (F, J, 4), real part last, and weights of the curves
    (F, C) where the crowd has some.
    """

    samples: Samples
    summary: MotionSummary


def motion_count(crowd: CrowdClip) -> int:
    """Return the number of motions that the characters play."""
    return int(crowd.motion.max()) + 1


def all_motions(crowd: CrowdClip, rig: CharacterRig) -> Iterator[MotionSamples]:
    """Yield the motions in order; at most one batch is in memory at a time.

    Raises ValueError for a number of motions other than the characters play, and for other shapes.
    """
    made = 0
    # The variable of a for loop would keep each batch in memory while the next is computed.
    for motion in chain.from_iterable(map(partial(_batch_motions, crowd, rig), crowd.batches)):
        made += 1
        yield motion
    if made != motion_count(crowd):
        raise ValueError(f"{made} motions, expected {motion_count(crowd)}")


def motion_layer(crowd: CrowdClip, rig: CharacterRig, samples: Samples) -> bytes:
    """Return the binary layer of one motion of a crowd."""
    author = AnimationLayerBuilder(crowd.rate, METRES, rig.paths, crowd.curves)
    return crate_template.usdc(author, LayerContent(samples, {}, {}))


def _batch_motions(crowd: CrowdClip, rig: CharacterRig, batch: Motions) -> Iterator[MotionSamples]:
    expected = (crowd.frames, len(crowd.skeleton), 4)
    if batch.rotations.shape[1:] != expected:
        raise ValueError(f"motions of {batch.rotations.shape[1:]}, expected {expected}")
    weights = _weights(crowd, batch)
    made = animation_samples.from_motions(batch)
    boxes = crowd_extent.boxes(rig, made)
    for index, (part, box) in enumerate(zip(made.parts(1), boxes, strict=True)):
        samples = {"translations": part.translations, "rotations": part.rotations}
        if weights is not None:
            samples[WEIGHTS] = weights[index]
        yield MotionSamples(samples, MotionSummary(box, _level_changes(batch.levels[index])))


def _weights(crowd: CrowdClip, batch: Motions) -> Singles | None:
    """Return the weights (M, F, C) of the curves of a batch; None for a crowd without curves.

    Raises ValueError for other curves than the crowd names.
    """
    found = () if batch.curves is None else batch.curves.shape
    expected = (len(batch), crowd.frames, len(crowd.curves)) if crowd.curves else ()
    if found != expected:
        raise ValueError(f"curves of {found}, expected {expected}")
    # USD's deduplication does not distinguish -0 from 0.
    return None if batch.curves is None else batch.curves + np.float32(0.0)


def _level_changes(levels: Indices) -> dict[int, int]:
    """Return the level by frame, for the first frame and each frame at which it changes."""
    changed = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1))
    return {int(frame): int(levels[frame]) for frame in changed}
