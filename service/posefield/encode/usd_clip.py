"""Clips as USD layers: a bound skeleton, its baked animation and a skinned body.

Layers of the animation alone are for stages in which many clips animate one character.

The layers are written without a stage, which is faster; every opened stage also leaks memory. The
names of prims are constant, because USD never frees a name. The arrays of many clips are computed
together, with the same result as one by one.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from pxr import Sdf

from posefield.common import cancellation
from posefield.common.units import Singles
from posefield.encode import archives, character, crate_template, extent, layers
from posefield.encode.character import CharacterRig, Convention
from posefield.encode.crate_template import Array, LayerBuilder, LayerContent
from posefield.encode.extent import AnimationSamples
from posefield.encode.layers import WEIGHTS, Samples
from posefield.motion.clip import Clip
from posefield.question.results import SampledClip

FRAMES_AT_ONCE = 3200
"""Frames of clips that are computed at a time; a longer clip is computed alone."""


WITHOUT_BODY = Convention(1.0, "y", "none")


def _grouped_by_rig(
    answers: Sequence[SampledClip], convention: Convention
) -> Iterator[tuple[CharacterRig, list[SampledClip]]]:
    """Yield consecutive results of one skeleton, at most FRAMES_AT_ONCE frames at a time."""
    _keep_freed_memory()
    for _, clips_of_skeleton in groupby(
        answers, lambda clip_answer: (id(clip_answer.clip.skeleton), clip_answer.clip.root_bone)
    ):
        group: list[SampledClip] = []
        frames = 0
        for answer in clips_of_skeleton:
            frames += len(answer.clip)
            if group and frames > FRAMES_AT_ONCE:
                yield _rig(group[0].clip, convention), group
                group, frames = [], len(answer.clip)
            group.append(answer)
        yield _rig(group[0].clip, convention), group


def _rig(clip: Clip, convention: Convention) -> CharacterRig:
    return character.rig(clip.skeleton, convention.body, clip.root_bone)


def _samples_of(answers: Sequence[SampledClip]) -> AnimationSamples:
    """Return the moves of results of one skeleton, with their root bones."""
    clips = [character.rig_and_clip(answer.clip, "none")[1] for answer in answers]
    return extent.samples_of_clips(clips, answers[0].clip.root_bone)


@cache
def _keep_freed_memory() -> None:
    """Make glibc keep up to 64 MB of freed memory.

    It would return large blocks to the system, and requesting their pages again would take as long
    as all other work. Its thresholds grow with the size of freed blocks (mallopt(3),
    M_MMAP_THRESHOLD).
    """
    np.empty(31 << 20, np.uint8)


def _content(answer: SampledClip, samples: Samples, values: Mapping[str, Array]) -> LayerContent:
    cancellation.check()
    return LayerContent(samples, values, answer.trust.facts())


def _curve_names(clip: Clip) -> tuple[str, ...]:
    return () if clip.curves is None else tuple(clip.curves.names)


def _samples(
    samples: AnimationSamples, answers: Sequence[SampledClip], convention: Convention
) -> Iterator[Samples]:
    translations = character.convert_positions(convention, samples.translations)
    rotations = character.convert_rotations(convention, samples.rotations)
    for answer, (first, last) in zip(answers, pairwise(samples.starts), strict=True):
        arrays = {"translations": translations[first:last], "rotations": rotations[first:last]}
        yield arrays | _weights(answer.clip)


def _weights(clip: Clip) -> dict[str, Singles]:
    """Return the curves (F, C) of a clip as weights of blend shapes; nothing without them."""
    if clip.curves is None:
        return {}
    # USD's deduplication does not distinguish -0 from 0.
    return {WEIGHTS: np.ascontiguousarray(clip.curves.values, np.float32) + np.float32(0.0)}


ROOT = Sdf.Path("/Character")
ANIMATION = ROOT.AppendChild("Anim")


@dataclass(frozen=True)
class ClipLayerBuilder(LayerBuilder):
    """Layers of clips of one skeleton. curves: names of the clips' curves."""

    rig: CharacterRig
    curves: tuple[str, ...] = ()

    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""
        layer = Sdf.Layer.CreateAnonymous("clip.usda")
        layer.TransferContent(_character_prims(self.rig, self.convention, self.curves))
        with Sdf.ChangeBlock():
            self.set_metadata(layer, ROOT.name, content)
            layers.set_character(layer.GetPrimAtPath(ROOT), layers.usd_values(content.values))
            layers.set_time_samples(layer.GetPrimAtPath(ANIMATION), content.samples)
        return layer


@lru_cache(maxsize=16)
def _character_prims(rig: CharacterRig, convention: Convention, curves: tuple[str, ...]) -> Any:
    """Return a layer of a character and its animation without numbers.

    Cached, since building it takes as long as exporting it.
    """
    layer = Sdf.Layer.CreateAnonymous("prims.usda")
    root = layers.add_character(layer, ROOT.name, rig, convention)
    layers.add_blend_shapes(root, rig, curves)
    animation = layers.add_animation(root, ANIMATION.name, rig.paths, curves)
    layers.bind_animation(root, animation.path)
    return layer


def usda(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return USD layers as text."""
    return [
        builder.layer(content).ExportToString().encode()
        for builder, content in builders_and_contents(answers, convention)
    ]


def usdc(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return USD layers in binary form."""
    return [crate_template.usdc(*pair) for pair in builders_and_contents(answers, convention)]


def usdz(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return USDZ files of one binary layer each."""
    return list(map(usdz_package, usdc(answers, convention)))


def usdz_package(layer: bytes) -> bytes:
    """Return a USDZ file that holds one binary layer."""
    return b"".join(archives.zip_chunks([archives.whole("clip.usdc", layer)]))


def builders_and_contents(
    answers: Sequence[SampledClip], convention: Convention
) -> Iterator[tuple[ClipLayerBuilder, LayerContent]]:
    """Yield the builder and the content of the layer of each result, in their order."""
    for rig, clips in _grouped_by_rig(answers, convention):
        animation = _samples_of(clips)
        rest = character.rest_pose(rig, animation.offsets)
        boxes = extent.bounding_boxes(rig.tree, animation, rest.radii)
        values = character.character_arrays(rest, convention)
        values["extent"] = character.convert_box(convention, boxes).astype(np.float32)
        for index, samples in enumerate(_samples(animation, clips, convention)):
            clip = clips[index].clip
            builder = ClipLayerBuilder(clip.rate, convention, rig, _curve_names(clip))
            clip_values = {name: array[index] for name, array in values.items()}
            yield builder, _content(clips[index], samples, clip_values)


ANIMATION_NAME = "Anim"


@dataclass(frozen=True)
class AnimationLayerBuilder(LayerBuilder):
    """Layers of an animation of joints with given paths, and of curves with given names."""

    paths: tuple[str, ...]
    curves: tuple[str, ...] = ()

    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""
        layer = Sdf.Layer.CreateAnonymous("animation.usda")
        self.set_metadata(layer, ANIMATION_NAME, content)
        with Sdf.ChangeBlock():
            layers.set_time_samples(
                layers.add_animation(layer, ANIMATION_NAME, self.paths, self.curves),
                content.samples,
            )
        return layer


def animation_usdc(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return binary layers of the clips' animations, with the facts and without a character."""
    return [crate_template.usdc(*pair) for pair in animation_contents(answers, convention)]


def animation_contents(
    answers: Sequence[SampledClip], convention: Convention
) -> Iterator[tuple[AnimationLayerBuilder, LayerContent]]:
    """Yield the builder and the content of the layer of each animation, in their order."""
    for rig, clips in _grouped_by_rig(answers, WITHOUT_BODY):
        animations = _samples(_samples_of(clips), clips, convention)
        for answer, samples in zip(clips, animations, strict=True):
            names = _curve_names(answer.clip)
            builder = AnimationLayerBuilder(answer.clip.rate, convention, rig.paths, names)
            yield builder, _content(answer, samples, {})
