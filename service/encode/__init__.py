"""Bytes of an answer in each format that the service writes."""

from collections.abc import Callable
from dataclasses import dataclass

from service.encode import bvh, keyframes, usd, usdz
from service.motion.answer import ClipAnswer


@dataclass(frozen=True)
class Encoder:
    """How one format is named and made; the same answer always gives the same bytes."""

    extension: str
    media_type: str
    encode: Callable[[ClipAnswer], bytes]


ENCODERS = {
    encoder.extension: encoder
    for encoder in (
        Encoder("usda", "model/vnd.usda", usd.usda),
        # The binary form has no registered media type.
        Encoder("usdc", "application/octet-stream", usd.usdc),
        Encoder("usdz", "model/vnd.usdz+zip", usdz.usdz),
        Encoder("json", "application/json", keyframes.json),
        Encoder("bvh", "application/x-bvh", bvh.bvh),
    )
}
