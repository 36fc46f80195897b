"""Clips as USD layers: a bound skeleton, its baked animation and a skinned body.

The layers are written without a stage, which is faster; every opened stage also leaks memory. The
names of prims are constant, because USD never frees a name.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from pxr import Sdf

from posefield.encode.character.character import CharacterRig
from posefield.encode.files import zip_archive
from posefield.encode.files.file_convention import Convention
from posefield.encode.usd import character_prims, clip_arrays
from posefield.encode.usd_layers import crate_template, prim_specs
from posefield.encode.usd_layers.layer_content import LayerContent
from posefield.encode.usd_layers.layer_metadata import BaseLayerBuilder
from posefield.question.results import SampledClip

ROOT = Sdf.Path("/Character")
ANIMATION = ROOT.AppendChild("Anim")


@dataclass(frozen=True)
class ClipLayerBuilder(BaseLayerBuilder):
    """Layers of clips of one skeleton. curves: names of the clips' curves."""

    rig: CharacterRig
    curves: tuple[str, ...] = ()

    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""
        made = Sdf.Layer.CreateAnonymous("clip.usda")
        made.TransferContent(_character_prims(self.rig, self.convention, self.curves))
        with Sdf.ChangeBlock():
            self.set_metadata(made, ROOT.name, content)
            character_prims.set_values(
                made.GetPrimAtPath(ROOT), character_prims.values(content.values)
            )
            prim_specs.set_time_samples(made.GetPrimAtPath(ANIMATION), content.samples)
        return made


@lru_cache(maxsize=16)
def _character_prims(rig: CharacterRig, convention: Convention, curves: tuple[str, ...]) -> Any:
    """Return a layer of a character and its animation without numbers.

    Cached, since building it takes as long as exporting it.
    """
    made = Sdf.Layer.CreateAnonymous("prims.usda")
    root = character_prims.root(made, ROOT.name, rig, convention)
    character_prims.add_blend_shapes(root, rig, curves)
    made_animation = character_prims.animation(root, ANIMATION.name, rig.paths, curves)
    character_prims.bind_animation(root, made_animation.path)
    return made


def usda(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return USD layers as text."""
    layers = (
        author.layer(content) for author, content in builders_and_contents(answers, convention)
    )
    return [layer.ExportToString().encode() for layer in layers]


def usdc(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return USD layers in binary form."""
    return [crate_template.usdc(*each) for each in builders_and_contents(answers, convention)]


def usdz(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return USDZ files of one binary layer each."""
    return list(map(usdz_package, usdc(answers, convention)))


def usdz_package(layer: bytes) -> bytes:
    """Return a USDZ file that holds one binary layer."""
    return b"".join(zip_archive.zip_chunks([zip_archive.whole("clip.usdc", layer)]))


def builders_and_contents(
    answers: Sequence[SampledClip], convention: Convention
) -> Iterator[tuple[ClipLayerBuilder, LayerContent]]:
    """Yield the author and the content of the layer of each answer."""
    for take in clip_arrays.arrays_with_character(answers, convention):
        yield ClipLayerBuilder(take.rate, convention, take.rig, take.curves), take.content
