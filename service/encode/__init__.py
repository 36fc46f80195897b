"""Bytes of an answer in each format that the service writes."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from service.encode import bvh, crowd_arrow, crowd_npz, crowd_poses, keyframes, usd, usdz
from service.motion.answer import ClipAnswer
from service.motion.crowd import CrowdPoses


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


@dataclass(frozen=True)
class CrowdEncoder:
    """How one format of crowd poses is named and made, and the most characters it is good for."""

    extension: str
    media_type: str
    encode: Callable[[CrowdPoses], bytes]
    most: float = math.inf


CROWD_ENCODERS = {
    encoder.extension: encoder
    for encoder in (
        CrowdEncoder("arrow", "application/vnd.apache.arrow.stream", crowd_arrow.arrow),
        # An archive of arrays has no registered media type; as a zip some browsers would unpack it.
        CrowdEncoder("npz", "application/octet-stream", crowd_npz.npz),
        CrowdEncoder("json", "application/json", crowd_poses.json, crowd_poses.JSON_LIMIT),
    )
}
