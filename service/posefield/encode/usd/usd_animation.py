"""USD layers of a SkelAnimation alone, for stages in which many clips animate one character."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pxr import Sdf

from posefield.encode.files.file_convention import Convention
from posefield.encode.usd import character_prims, clip_arrays
from posefield.encode.usd_layers import crate_template, prim_specs
from posefield.encode.usd_layers.layer_content import LayerContent
from posefield.encode.usd_layers.layer_metadata import BaseLayerBuilder
from posefield.question.results import SampledClip

ANIMATION_NAME = "Anim"


@dataclass(frozen=True)
class AnimationLayerBuilder(BaseLayerBuilder):
    """Layers of an animation of joints with given paths, and of curves with given names."""

    paths: tuple[str, ...]
    curves: tuple[str, ...] = ()

    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""
        made = Sdf.Layer.CreateAnonymous("animation.usda")
        self.set_metadata(made, ANIMATION_NAME, content)
        with Sdf.ChangeBlock():
            prim_specs.set_time_samples(
                character_prims.animation(made, ANIMATION_NAME, self.paths, self.curves),
                content.samples,
            )
        return made


def usdc(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return binary layers of the clips' animations, with the facts and without a character."""
    return [
        crate_template.usdc(
            AnimationLayerBuilder(take.rate, convention, take.rig.paths, take.curves), take.content
        )
        for take in clip_arrays.arrays_without_character(answers, convention)
    ]
