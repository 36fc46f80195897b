"""Clips as the arrays of their files, computed together with the same result as one by one."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np

from posefield.common import cancellation
from posefield.encode.character import animation_samples, character, extent
from posefield.encode.character.animation_samples import Moves
from posefield.encode.character.character import Rig
from posefield.encode.files import axis_conversion
from posefield.encode.files.file_convention import Convention
from posefield.encode.usd import custom_data
from posefield.encode.usd.layer_content import Array, Content, Samples
from posefield.question.results import ClipAnswer

TOGETHER = 3200
"""Frames of clips that are computed at a time; a longer clip is computed alone."""


class Take(NamedTuple):
    """Rig, frame rate and layer content of one clip."""

    rig: Rig
    rate: float
    content: Content


def whole(answers: Sequence[ClipAnswer], convention: Convention) -> Iterator[Take]:
    """Yield takes in the order of their results, with samples, character values and facts."""
    for rig, some in _alike(answers):
        made = animation_samples.of_clips([answer.clip for answer in some])
        rest = character.resting(rig, made.offsets)
        boxes = extent.boxes(rig.tree, made, character.balls(rest))
        values = character.numbers(rest, convention)
        values["extent"] = axis_conversion.box(convention, boxes).astype(np.float32)
        for index, samples in enumerate(_samples(made, convention)):
            own = {name: array[index] for name, array in values.items()}
            yield _take(rig, some[index], samples, own)


def bare(answers: Sequence[ClipAnswer], convention: Convention) -> Iterator[Take]:
    """Yield takes in the order of their results, with samples and facts only."""
    for rig, some in _alike(answers):
        made = animation_samples.of_clips([answer.clip for answer in some])
        for answer, samples in zip(some, _samples(made, convention), strict=True):
            yield _take(rig, answer, samples, {})


def _alike(answers: Sequence[ClipAnswer]) -> Iterator[tuple[Rig, list[ClipAnswer]]]:
    """Yield consecutive results of one skeleton, at most TOGETHER frames at a time."""
    _keep_freed_memory()
    for _, some in groupby(answers, lambda answer: id(answer.clip.skeleton)):
        part: list[ClipAnswer] = []
        frames = 0
        for answer in some:
            frames += len(answer.clip)
            if part and frames > TOGETHER:
                yield character.rig(part[0].clip.skeleton), part
                part, frames = [], len(answer.clip)
            part.append(answer)
        yield character.rig(part[0].clip.skeleton), part


@cache
def _keep_freed_memory() -> None:
    """Make glibc keep up to 64 MB of freed memory.

    It would return large blocks to the system, and requesting their pages again would take as long
    as all other work. Its thresholds grow with the size of freed blocks (mallopt(3),
    M_MMAP_THRESHOLD).
    """
    np.empty(31 << 20, np.uint8)


def _take(rig: Rig, answer: ClipAnswer, samples: Samples, values: Mapping[str, Array]) -> Take:
    cancellation.check()
    content = Content(samples, values, custom_data.parted(answer.trust.facts()))
    return Take(rig, answer.clip.rate, content)


def _samples(made: Moves, convention: Convention) -> Iterator[Samples]:
    translations = axis_conversion.places(convention, made.translations)
    rotations = axis_conversion.rotations(convention, made.rotations)
    for first, last in pairwise(made.starts):
        yield {"translations": translations[first:last], "rotations": rotations[first:last]}
