"""Kinds of body that a file may show a skeleton with."""

from typing import Annotated, Literal

from msgspec import Meta

BodyKind = Literal["none", "mannequin", "bones"]
DEFAULT_BODY: BodyKind = "mannequin"

Body = Annotated[
    BodyKind | None,
    Meta(
        description="body in USD and glTF files: none, mannequin or one box per bone; default: "
        "mannequin"
    ),
]
