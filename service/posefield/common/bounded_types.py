"""Types of numbers and texts with bounds.

Python ignores the bounds; msgspec checks them where a field is decoded. The card of a model is
decoded by service/posefield/model_file/checked_file.py.
"""

from typing import Annotated

from msgspec import Meta

# Larger numbers would overflow when they are squared in float32.
_MAX_NUMBER = 1e15
MAX_INTEGER = 2**53
"""Largest integer up to which floats hold all of them."""

Text = Annotated[str, Meta(max_length=100_000)]
Name = Annotated[str, Meta(min_length=1, max_length=1_000)]
Slug = Annotated[str, Meta(pattern="^[a-z0-9][a-z0-9_-]{0,63}$")]
"""Name of a model, as written in recipes."""
Key = Annotated[str, Meta(pattern="^[a-z][a-z0-9_]{0,39}$")]
"""Name of a control, as written in recipes."""

Number = Annotated[float, Meta(ge=-_MAX_NUMBER, le=_MAX_NUMBER)]
Positive = Annotated[float, Meta(gt=0.0, le=_MAX_NUMBER)]
NonNegative = Annotated[float, Meta(ge=0.0, le=_MAX_NUMBER)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Rate = Annotated[float, Meta(ge=1.0, le=10_000.0)]
"""Frames a second."""

Count = Annotated[int, Meta(ge=1, le=MAX_INTEGER)]
Index = Annotated[int, Meta(ge=0, le=MAX_INTEGER)]
Parent = Annotated[int, Meta(ge=-1, le=MAX_INTEGER)]
"""Index of a parent, -1 for none."""
Whole = Annotated[int, Meta(ge=-MAX_INTEGER, le=MAX_INTEGER)]
"""Integer of a question; NumPy and float arithmetic hold it."""
Degree = Annotated[int, Meta(ge=0, le=1)]
"""Degree of a polynomial drift."""
