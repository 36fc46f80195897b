"""A clip as one USD layer: a bound skeleton, its baked animation and a light skinned body.

Written into a layer without a stage: it is faster, and a stage leaks for each that is opened.
The names of prims never vary, because USD keeps every name that it has ever seen.
"""

from typing import Any

from pxr import Sdf

from service.encode import bounds, character, facts, layers, specs
from service.encode.character import Rig
from service.encode.convention import Convention
from service.motion import quat
from service.motion.answer import ClipAnswer
from service.motion.clip import Clip


def usda(answer: ClipAnswer, convention: Convention) -> bytes:
    """USD as text."""
    text: str = layer(answer).ExportToString()
    return text.encode()


def usdc(answer: ClipAnswer, convention: Convention) -> bytes:
    """USD in its binary form."""
    return layers.crate(layer(answer))


def layer(answer: ClipAnswer) -> Any:
    """Layer that holds the clip; the caller must keep it, since its prims do not."""
    made = Sdf.Layer.CreateAnonymous("clip.usda")
    clip = answer.clip
    with Sdf.ChangeBlock():
        layers.head(made, "Character", len(clip), clip.rate)
        made.customLayerData = {"posefield": facts.dictionary(answer.trust.facts())}
        _character(made, clip, _rig(clip))
    return made


def _rig(clip: Clip) -> Rig:
    offsets = clip.translations[0].copy()
    offsets[0] = clip.skeleton.offsets[0]
    return character.rig(clip.skeleton, offsets)


def _character(made: Any, clip: Clip, rig: Rig) -> None:
    root = character.root(made, "Character", rig, bounds.over(clip, rig.bones, rig.rest))
    animation = character.animation(root, "Anim", rig.paths)
    character.bind(root, animation)
    # Readers that interpolate quaternions by component need neighbours of the same sign.
    moves = specs.vector_frames(clip.translations)
    specs.samples(made, animation.path.AppendProperty("translations"), moves)
    turns = specs.quaternion_frames(quat.unroll(clip.rotations))
    specs.samples(made, animation.path.AppendProperty("rotations"), turns)
