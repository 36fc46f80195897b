"""Query for a walking crowd."""

import math
from typing import Annotated, Literal

from msgspec import Meta, Struct

from posefield.common.bounded_types import Whole
from posefield.common.errors import InvalidField
from posefield.question.motion_question import DEFAULT_VARIETY, Body, FeetMode, LabelValue

Instancing = Literal["references", "scenegraph", "flatten"]
DEFAULT_INSTANCING: Instancing = "references"
WalkerTake = Literal["index"] | Whole
"""Seed of all characters, or "index" for a seed of its own for each."""
DEFAULT_FOV, DEFAULT_HEIGHT, DEFAULT_PIXELS = math.pi / 3.0, 1080.0, 1.0
MAX_CHARACTERS = 1_000_000  # Of one crowd, who may share motions.

FieldOfView = Annotated[
    float | None,
    Meta(description="vertical field of view, rad; default: 60 degrees; requires a camera"),
]
ImageHeight = Annotated[
    float | None,
    Meta(description="height of the image, pixels; default: 1080; requires a camera"),
]
LevelPixels = Annotated[
    float | None,
    Meta(description="limit of a level's error, pixels; default: 1; requires a camera"),
]


class WalkQuestion(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Query for a walking crowd: its size, motions, level of detail and instancing in USD.

    motions: number of different motions. camera (m), fov (rad), height (pixels of the image):
    select levels of detail whose projected error is at most `pixels`.
    """

    # The default crowd fits a browser's tab: some ten megabytes.
    count: Annotated[Whole, Meta(description="number of characters, each on its own path")] = 100
    motions: Annotated[
        Whole | None,
        Meta(description="number of distinct motions; default: one motion per character"),
    ] = None
    seconds: Annotated[float, Meta(description="duration, s", extra={"unit": "s"})] = 5.0
    fps: Annotated[float, Meta(description="frame rate, frames a second")] = 30.0
    seed: Annotated[Whole, Meta(description="seed of all random numbers")] = 0
    labels: Annotated[
        dict[str, LabelValue],
        Meta(
            description="name of all characters in a label set such as style, or weights of names "
            "(angry:0.7,happy:0.3); in other sets each has captured names; may be repeated",
            extra={"word": "label", "metavar": "SET=NAME"},
        ),
    ] = {}
    level: Annotated[
        Whole | None,
        Meta(description="level of detail; 0 is the finest; default: 0"),
    ] = None
    camera: Annotated[
        tuple[float, float, float] | None,
        Meta(
            description="camera position, m, which selects the level of detail of each pose",
            extra={"metavar": "X,Y,Z"},
        ),
    ] = None
    fov: FieldOfView = None
    height: ImageHeight = None
    pixels: LevelPixels = None
    feet: Annotated[
        FeetMode | None,
        Meta(
            description="whether feet stand where they contact the ground; default: stand, for "
            "models that know the contacts of their feet and for 20 or more frames a second"
        ),
    ] = None
    take: Annotated[
        WalkerTake,
        Meta(
            description="seed of another take of all characters' motions, or index: a seed of its "
            "own for each motion, so that no two are alike; 0 is the mean",
            extra={"metavar": "SEED|index"},
        ),
    ] = 0
    variety: Annotated[
        float, Meta(description="size of the takes' deviations; 1 is that of captured clips")
    ] = DEFAULT_VARIETY
    detail: Annotated[
        bool, Meta(description="add details that no control predicts, sampled by the takes' seeds")
    ] = False
    instancing: Annotated[
        Instancing, Meta(description="sharing of data between characters in USD")
    ] = DEFAULT_INSTANCING
    body: Body = None

    def __post_init__(self) -> None:
        if self.camera is None:
            for name in ("fov", "height", "pixels"):
                if getattr(self, name) is not None:
                    raise InvalidField(name, "given without a camera, expected only with one")

    def check(self) -> None:
        """Raise InvalidField for a number out of range, and for what a camera excludes."""
        if not 1 <= self.count <= MAX_CHARACTERS:
            raise InvalidField("count", f"{self.count}, expected 1 to {MAX_CHARACTERS} characters")
        if self.level is not None and self.camera is not None:
            raise InvalidField("level", f"{self.level}, expected none: the camera chooses it")
        if self.motions is not None and not 1 <= self.motions <= self.count:
            raise InvalidField("motions", f"{self.motions}, expected 1 to {self.count} characters")
        if self.motions is not None and self.camera is not None:
            raise InvalidField("motions", "shared near and far, expected a level and no camera")
        if self.pixels is not None and not self.pixels >= 0.0:
            raise InvalidField("pixels", f"{self.pixels:g}, expected 0 or more")
