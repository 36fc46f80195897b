"""Files of performances: as those of clips, or with an animation for each segment."""

from collections.abc import Callable

from posefield.common.errors import InvalidField
from posefield.encode.conventions import Convention
from posefield.encode.formats import ClipEncoder
from posefield.question.performance_question import PerformanceLayout
from posefield.question.performance_report import PerformanceAnswer

SEGMENTED = ("usda", "usdc", "usdz")
"""Formats that have layouts."""

PerformanceEncoder = Callable[[PerformanceAnswer, Convention], bytes]


def encoder(form: ClipEncoder, layout: PerformanceLayout) -> PerformanceEncoder:
    """Return the function that encodes performances in a format and a layout.

    Raises InvalidField for a layout of segments in a format that has none.
    """
    if layout == "whole":
        return form.encode
    if form.extension not in SEGMENTED:
        raise InvalidField(
            "layout",
            f"{layout!r}, expected 'whole': {form.extension} files have no layouts, "
            f"{', '.join(SEGMENTED[:-1])} and {SEGMENTED[-1]} do",
        )

    def encode(answer: PerformanceAnswer, convention: Convention) -> bytes:
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.encode.usd import performance_layer

        writers = {
            "usda": performance_layer.usda,
            "usdc": performance_layer.usdc,
            "usdz": performance_layer.usdz,
        }
        return writers[form.extension](answer, convention)

    return encode
