"""Questions for a grid of sigma as they travel: query parameters and JSON bodies."""

import msgspec

from service.motion.errors import InvalidField
from service.synthesis.grid import STEPS, GridQuestion
from service.web import decoding, query
from service.web.query import Pairs
from service.web.settings import Settings


class GridBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Schema SigmaQuestion of the contract."""

    across: str
    along: str
    # JSON has one kind of number: 32.0 is a whole one.
    columns: float = float(STEPS)
    rows: float = float(STEPS)
    controls: dict[str, msgspec.Raw] = {}
    performer: str | None = None
    margin: float = 0.0


_GRID = msgspec.json.Decoder(GridBody)


def of_pairs(pairs: Pairs, settings: Settings) -> GridQuestion:
    """Question of query parameters: across, along, columns, rows, margin, performer, and one for
    each control that is fixed."""
    single = query.unique(pairs)
    across, along = (_named(single, name) for name in ("across", "along"))
    columns, rows = (
        query.whole(name, single.pop(name, str(STEPS))) for name in ("columns", "rows")
    )
    performer = single.pop("performer", None)
    numbers = query.numbers_of(single)
    margin = numbers.pop("margin", 0.0)
    asked = GridQuestion(across, along, columns, rows, numbers, performer, margin)
    return _bounded(asked, settings)


def _named(single: dict[str, str], name: str) -> str:
    if name not in single:
        raise query.bad_parameter(name, "missing; give the name of a control")
    return single.pop(name)


def of_body(content: bytes, settings: Settings) -> GridQuestion:
    """Question of a JSON body."""
    body = decoding.decoded(_GRID, content)
    columns, rows = (query.whole_number(name, getattr(body, name)) for name in ("columns", "rows"))
    controls = query.controls_of(body.controls)
    asked = GridQuestion(
        body.across, body.along, columns, rows, controls, body.performer, body.margin
    )
    return _bounded(asked, settings)


def _bounded(asked: GridQuestion, settings: Settings) -> GridQuestion:
    if len(asked) > settings.grid_limit:
        expected = f"expected at most {settings.grid_limit}"
        raise InvalidField("rows", f"{len(asked)} points of columns and rows, {expected}")
    return asked
