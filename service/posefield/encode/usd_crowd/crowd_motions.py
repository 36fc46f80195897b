"""Motions of a crowd as USD samples, one at a time."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.encode.character import animation_samples
from posefield.encode.character.character import CharacterRig
from posefield.encode.files.file_convention import METRES
from posefield.encode.usd import custom_data
from posefield.encode.usd.layer_content import LayerContent, Samples
from posefield.encode.usd.template_cache import CRATE_CACHE, TemplateCache
from posefield.encode.usd.usd_animation import AnimationLayerBuilder
from posefield.encode.usd_crowd import crowd_extent
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

    samples: translations (F, J, 3), and rotations (F, J, 4), real part last.
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


def motion_layer(
    rig: CharacterRig, rate: float, samples: Samples, press: TemplateCache = CRATE_CACHE
) -> bytes:
    """Return the binary layer of one motion, written by `press`."""
    return press.write(
        AnimationLayerBuilder(rate, METRES, rig.paths),
        LayerContent(samples, {}, custom_data.NO_FACTS),
    )


def _batch_motions(crowd: CrowdClip, rig: CharacterRig, batch: Motions) -> Iterator[MotionSamples]:
    expected = (crowd.frames, len(crowd.skeleton), 4)
    if batch.rotations.shape[1:] != expected:
        raise ValueError(f"motions of {batch.rotations.shape[1:]}, expected {expected}")
    made = animation_samples.from_motions(batch)
    boxes = crowd_extent.boxes(rig, made)
    for part, box, levels in zip(made.parts(1), boxes, batch.levels, strict=True):
        samples = {"translations": part.translations, "rotations": part.rotations}
        yield MotionSamples(samples, MotionSummary(box, _level_changes(levels)))


def _level_changes(levels: Indices) -> dict[int, int]:
    """Return the level by frame, for the first frame and each frame at which it changes."""
    changed = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1))
    return {int(frame): int(levels[frame]) for frame in changed}
