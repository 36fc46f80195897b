"""Clips as the arrays of their files, computed together with the same result as one by one."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np

from posefield.common import cancellation
from posefield.common.units import Singles
from posefield.encode.character import animation_samples, character, extent
from posefield.encode.character.animation_samples import AnimationSamples
from posefield.encode.character.character import CharacterRig
from posefield.encode.files import file_convention
from posefield.encode.files.file_convention import Convention
from posefield.encode.usd_layers.layer_content import WEIGHTS, Array, LayerContent, Samples
from posefield.motion.clip import Clip
from posefield.question.results import SampledClip

FRAMES_AT_ONCE = 3200
"""Frames of clips that are computed at a time; a longer clip is computed alone."""


WITHOUT_BODY = Convention(1.0, "y", "none")


class ClipArrays(NamedTuple):
    """Rig, frame rate, layer content and names of the curves of one clip."""

    rig: CharacterRig
    rate: float
    content: LayerContent
    curves: tuple[str, ...]


def arrays_with_character(
    answers: Sequence[SampledClip], convention: Convention
) -> Iterator[ClipArrays]:
    """Yield arrays in the order of their results, with samples, character values and facts."""
    for rig, some in _grouped_by_rig(answers, convention):
        made = animation_samples.from_clips([answer.clip for answer in some])
        rest = character.rest_pose(rig, made.offsets)
        boxes = extent.bounding_boxes(rig.tree, made, rest.radii)
        values = character.character_arrays(rest, convention)
        values["extent"] = file_convention.convert_box(convention, boxes).astype(np.float32)
        for index, samples in enumerate(_samples(made, some, convention)):
            own = {name: array[index] for name, array in values.items()}
            yield _clip_arrays(rig, some[index], samples, own)


def arrays_without_character(
    answers: Sequence[SampledClip], convention: Convention
) -> Iterator[ClipArrays]:
    """Yield arrays in the order of their results, with samples and facts only."""
    for rig, some in _grouped_by_rig(answers, WITHOUT_BODY):
        made = animation_samples.from_clips([answer.clip for answer in some])
        for answer, samples in zip(some, _samples(made, some, convention), strict=True):
            yield _clip_arrays(rig, answer, samples, {})


def _grouped_by_rig(
    answers: Sequence[SampledClip], convention: Convention
) -> Iterator[tuple[CharacterRig, list[SampledClip]]]:
    """Yield consecutive results of one skeleton, at most FRAMES_AT_ONCE frames at a time."""
    _keep_freed_memory()
    for _, some in groupby(answers, lambda answer: id(answer.clip.skeleton)):
        part: list[SampledClip] = []
        frames = 0
        for answer in some:
            frames += len(answer.clip)
            if part and frames > FRAMES_AT_ONCE:
                yield character.rig(part[0].clip.skeleton, convention.body), part
                part, frames = [], len(answer.clip)
            part.append(answer)
        yield character.rig(part[0].clip.skeleton, convention.body), part


@cache
def _keep_freed_memory() -> None:
    """Make glibc keep up to 64 MB of freed memory.

    It would return large blocks to the system, and requesting their pages again would take as long
    as all other work. Its thresholds grow with the size of freed blocks (mallopt(3),
    M_MMAP_THRESHOLD).
    """
    np.empty(31 << 20, np.uint8)


def _clip_arrays(
    rig: CharacterRig, answer: SampledClip, samples: Samples, values: Mapping[str, Array]
) -> ClipArrays:
    cancellation.check()
    content = LayerContent(samples, values, answer.trust.facts())
    names = answer.clip.curves.names if answer.clip.curves else ()
    return ClipArrays(rig, answer.clip.rate, content, tuple(names))


def _samples(
    made: AnimationSamples, answers: Sequence[SampledClip], convention: Convention
) -> Iterator[Samples]:
    translations = file_convention.convert_positions(convention, made.translations)
    rotations = file_convention.convert_rotations(convention, made.rotations)
    for answer, (first, last) in zip(answers, pairwise(made.starts), strict=True):
        own = {"translations": translations[first:last], "rotations": rotations[first:last]}
        yield own | _weights(answer.clip)


def _weights(clip: Clip) -> dict[str, Singles]:
    """Return the curves (F, C) of a clip as weights of blend shapes; nothing without them."""
    if clip.curves is None:
        return {}
    # USD's deduplication does not distinguish -0 from 0.
    return {WEIGHTS: np.ascontiguousarray(clip.curves.values, np.float32) + np.float32(0.0)}
