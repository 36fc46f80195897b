"""Questions why an answer is as it is, as they travel: query parameters and JSON bodies."""

import msgspec

from service.synthesis.question import POLICY, Policy
from service.synthesis.why import NEAREST, WhyQuestion
from service.web import decoding, query
from service.web.query import Pairs


class WhyBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Schema WhyQuestion of the contract."""

    controls: dict[str, msgspec.Raw]
    extrapolate: Policy = POLICY
    performer: str | None = None
    nearest: float = float(NEAREST)


_WHY = msgspec.json.Decoder(WhyBody)


def of_pairs(pairs: Pairs) -> WhyQuestion:
    """Question of query parameters: nearest, extrapolate, performer, and one for each control."""
    single = query.unique(pairs)
    policy, performer = query.policy_of(single), single.pop("performer", None)
    nearest = query.whole("nearest", single.pop("nearest", str(NEAREST)))
    return WhyQuestion(query.numbers_of(single), policy, performer, nearest)


def of_body(content: bytes) -> WhyQuestion:
    """Question of a JSON body."""
    body = decoding.decoded(_WHY, content)
    nearest = query.whole_number("nearest", body.nearest)
    return WhyQuestion(query.controls_of(body.controls), body.extrapolate, body.performer, nearest)
