"""Clips as files of the service's own encoders, in each of the formats that training reads."""

from posefield.encode.character import METRES, Convention
from posefield.encode.formats import CLIP_ENCODERS
from posefield.question.results import SampledClip, Trust

TRUST = Trust("a@0123456789abcdef", {}, None, 0, 1.0, 0.0, True, ())
CENTIMETRES_Z = Convention(0.01, "z")
FORMATS = {"bvh": METRES, "usda": METRES, "usdc": CENTIMETRES_Z, "usdz": METRES, "glb": METRES}
"""Formats and the convention in which each is written here."""


def encoded(clip, ending, body="mannequin"):
    """The bytes of a clip in a format."""
    said = FORMATS[ending]
    own = said if ending == "bvh" else Convention(said.metres_per_unit, said.up, body)
    return CLIP_ENCODERS[ending].encode(SampledClip(clip, TRUST), own)
