"""Query for a walking crowd."""

import math
from typing import Annotated, Literal

from msgspec import Meta, Struct

from posefield.common.errors import InvalidField

Instancing = Literal["references", "scenegraph", "flatten"]
FOV, HEIGHT = math.pi / 3.0, 1080.0


class WalkQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Query for a walking crowd: its size, motions, level of detail and instancing in USD.

    motions: number of different motions. camera (m), fov (rad), height (pixels of the image):
    select levels of detail whose projected error is at most `pixels`.
    """

    # The default crowd fits a browser's tab: some ten megabytes.
    count: Annotated[int, Meta(description="characters, each on a way of its own")] = 100
    motions: Annotated[
        int | None, Meta(description="different motions they share; each its own if not said")
    ] = None
    seconds: Annotated[float, Meta(description="how long they walk", extra={"unit": "s"})] = 5.0
    fps: Annotated[float, Meta(description="frames a second")] = 30.0
    seed: Annotated[int, Meta(description="of all that is random")] = 0
    level: Annotated[
        int | None,
        Meta(description="level of detail: 0 is the finest; 0 if not said"),
    ] = None
    camera: Annotated[
        tuple[float, float, float] | None,
        Meta(
            description="instead of a level: where one looks from, m",
            extra={"metavar": "X,Y,Z"},
        ),
    ] = None
    fov: Annotated[float | None, Meta(description="vertical field of view, rad")] = None
    height: Annotated[float | None, Meta(description="of the image, pixels")] = None
    pixels: Annotated[float | None, Meta(description="that a level's error may cover")] = None
    instancing: Annotated[Instancing, Meta(description="what characters share in USD")] = (
        "references"
    )

    def __post_init__(self) -> None:
        if self.camera is None:
            for name in ("fov", "height", "pixels"):
                if getattr(self, name) is not None:
                    raise InvalidField(name, "given without a camera, expected only with one")
