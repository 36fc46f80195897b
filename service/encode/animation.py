"""Layers of a SkelAnimation alone, for stages in which many clips move one character."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pxr import Sdf

from service.encode import character, specs, takes
from service.encode.content import Array, Content
from service.encode.convention import Convention
from service.encode.layers import Kind
from service.encode.press import CRATES
from service.motion.answer import ClipAnswer

PRIM = "Anim"


@dataclass(frozen=True)
class Animations(Kind):
    """Layers of joints at these paths."""

    paths: tuple[str, ...]

    @property
    def values(self) -> tuple[Array, ...]:
        """Arrays that every layer holds."""
        return ()

    def head(self, content: Content) -> Any:
        """The layer without its prims."""
        made = Sdf.Layer.CreateAnonymous("animation.usda")
        self.state(made, PRIM, content)
        return made

    def layer(self, content: Content) -> Any:
        """The layer, made by usd-core; the caller must keep it, since its prims do not."""
        made = self.head(content)
        with Sdf.ChangeBlock():
            specs.samples(character.animation(made, PRIM, self.paths), content.samples)
        return made


def usdc(answers: Sequence[ClipAnswer], convention: Convention) -> list[bytes]:
    """Binary layers of the clips' animations, without a character; the facts are in each."""
    return [
        CRATES.write(Animations(take.rate, convention, take.rig.paths), take.content)
        for take in takes.bare(answers, convention)
    ]
