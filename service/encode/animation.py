"""USD layers of a SkelAnimation alone, for stages in which many clips animate one character."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pxr import Sdf

from service.encode import character_prims, specs, takes
from service.encode.content import Array, Content
from service.encode.convention import Convention
from service.encode.layers import Kind
from service.encode.press import CRATES
from service.motion.answer import ClipAnswer

PRIM = "Anim"


@dataclass(frozen=True)
class Animations(Kind):
    """Layers of an animation of joints with given paths."""

    paths: tuple[str, ...]

    @property
    def values(self) -> tuple[Array, ...]:
        """Return the arrays that every layer holds."""
        return ()

    def head(self, content: Content) -> Any:
        """Return the layer without its prims."""
        made = Sdf.Layer.CreateAnonymous("animation.usda")
        self.state(made, PRIM, content)
        return made

    def layer(self, content: Content) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""
        made = self.head(content)
        with Sdf.ChangeBlock():
            specs.samples(character_prims.animation(made, PRIM, self.paths), content.samples)
        return made


def usdc(answers: Sequence[ClipAnswer], convention: Convention) -> list[bytes]:
    """Return binary layers of the clips' animations, with the facts and without a character."""
    return [
        CRATES.write(Animations(take.rate, convention, take.rig.paths), take.content)
        for take in takes.bare(answers, convention)
    ]
