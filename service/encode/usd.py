"""Clips as USD layers: a bound skeleton, its baked animation and a light skinned body.

Written into a layer without a stage: it is faster, and a stage leaks for each that is opened.
The names of prims never vary, because USD keeps every name that it has ever seen.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pxr import Sdf

from service.encode import body, character, specs, takes
from service.encode.character import Rig
from service.encode.content import Array, Content
from service.encode.convention import Convention
from service.encode.layers import Kind
from service.encode.press import CRATES, TEXTS
from service.motion.answer import ClipAnswer

ROOT = Sdf.Path("/Character")
ANIMATION = ROOT.AppendChild("Anim")
TINTS = body.TINTS.astype(np.float32)


@dataclass(frozen=True)
class Clips(Kind):
    """Layers of clips of one skeleton."""

    rig: Rig

    @property
    def values(self) -> tuple[Array, ...]:
        """Arrays that every layer holds."""
        return (TINTS,)

    def head(self, content: Content) -> Any:
        """The layer without its prims."""
        made = Sdf.Layer.CreateAnonymous("clip.usda")
        self.state(made, ROOT.name, content)
        return made

    def layer(self, content: Content) -> Any:
        """The layer, made by usd-core; the caller must keep it, since its prims do not."""
        made = Sdf.Layer.CreateAnonymous("clip.usda")
        made.TransferContent(_prims(self.rig))
        with Sdf.ChangeBlock():
            self.state(made, ROOT.name, content)
            character.fill(made.GetPrimAtPath(ROOT), content.values)
            specs.samples(made.GetPrimAtPath(ANIMATION), content.samples)
        return made


@lru_cache(maxsize=16)
def _prims(rig: Rig) -> Any:
    """Layer of a character and its animation without numbers; kept, for it takes as long to make
    as to export."""
    made = Sdf.Layer.CreateAnonymous("prims.usda")
    root = character.root(made, ROOT.name, rig)
    character.bind(root, character.animation(root, ANIMATION.name, rig.paths).path)
    return made


def usda(answers: Sequence[ClipAnswer], convention: Convention) -> list[bytes]:
    """USD as text."""
    return [TEXTS.write(*each) for each in _authored(answers, convention)]


def usdc(answers: Sequence[ClipAnswer], convention: Convention) -> list[bytes]:
    """USD in its binary form."""
    return [CRATES.write(*each) for each in _authored(answers, convention)]


def _authored(
    answers: Sequence[ClipAnswer], convention: Convention
) -> Iterator[tuple[Clips, Content]]:
    for take in takes.whole(answers, convention):
        yield Clips(take.rate, convention, take.rig), take.content
