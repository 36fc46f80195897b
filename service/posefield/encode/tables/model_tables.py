"""Answers about a model: sigma grids as tables; reasons and suggestions as JSON and as text."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from posefield.encode.tables import table as tables
from posefield.encode.tables.table import Table
from posefield.question.results import (
    CapturedClip,
    Explanation,
    SigmaGrid,
    Suggestion,
    Suggestions,
    SupportReport,
)

DECIMALS = 9
"""Decimals that do not depend on the machine that solved the kriging system."""
SUGGESTION_HEADING = ("gain", "variance", "lacks", "nearest clip", "controls")


def table(grid: SigmaGrid) -> Table:
    """Return the values of both axes, with sigma, inside and supported (R, C) as arrays."""
    arrays = {
        "across_values": grid.across.values,
        "along_values": grid.along.values,
        "sigma": tables.as_float32(grid.sigma),
        "inside": grid.inside,
        "supported": grid.supported,
    }
    return Table({}, _facts(grid), arrays)


def points(grid: SigmaGrid) -> Table:
    """Return the grid as a table of R C rows, ordered by `along`, then `across`."""
    across, along = np.meshgrid(grid.across.values, grid.along.values)
    columns = {
        "across_values": across.ravel(),
        "along_values": along.ravel(),
        "sigma": tables.as_float32(grid.sigma).ravel(),
        "inside": grid.inside.ravel(),
        "supported": grid.supported.ravel(),
    }
    return Table(columns, _facts(grid))


def _facts(grid: SigmaGrid) -> dict[str, Any]:
    across, along = grid.across.control, grid.along.control
    return {
        "model": grid.model,
        "across": across.name,
        "along": along.name,
        "controls": grid.controls,
        "performer": grid.performer,
        **_labels(grid.labels),
        "units": {"across": across.unit, "along": along.unit, "sigma": "metre"},
    }


def explanation(found: Explanation) -> dict[str, Any]:
    """Return the reasons in the schema Reasons of the API."""
    backing = found.backing
    return {
        "model": found.model,
        "controls": found.controls,
        "performer": found.performer,
        **_labels(found.labels),
        "warnings": list(found.warnings),
        "support": {
            "supported": backing.supported,
            "beyond": {name: round(share, DECIMALS) for name, share in backing.beyond.items()},
            "most_beyond": backing.most,
            "variance": round(backing.variance, DECIMALS),
            "most_variance": round(backing.limit, DECIMALS),
        },
        "nearest": [_clip_facts(clip) for clip in found.nearest],
        "others": {
            "count": found.others,
            "weight": round(found.others_weight, DECIMALS),
            "share": round(found.others_share, DECIMALS),
        },
        **({"inferred": list(found.inferred)} if found.inferred else {}),
    }


def _clip_facts(clip: CapturedClip) -> dict[str, Any]:
    rounded = ("distance", "weight", "share")
    plain = {name: value for name, value in vars(clip).items() if name != "labels"}
    numbers = {name: round(getattr(clip, name), DECIMALS) for name in rounded}
    return {**plain, **numbers, **_labels(clip.labels)}


def _labels(labels: Mapping[str, Any]) -> dict[str, Any]:
    """Return labels by their key; nothing where there are none."""
    return {"labels": dict(labels)} if labels else {}


def explanation_text(found: Explanation) -> str:
    """Return one line for each clip, the nearest first, one for all others, and the support."""
    wide = max(len("clip"), *(len(clip.source) for clip in found.nearest))
    lines = [f"{'clip':{wide}}  distance    share     weight  "]
    lines += [
        f"{clip.source:{wide}}  {clip.distance:8.3f}  {_percent(clip.share)}   "
        f"{_percent(clip.weight)}  "
        f"{_clip_line(clip)}"
        for clip in found.nearest
    ]
    others = f"{found.others} others"
    shares = f"{_percent(found.others_share)}   {_percent(found.others_weight)}"
    lines.append(f"{others:{wide}}  {'':8}  {shares}")
    lines.append(_support_line(found.backing))
    return "\n".join(line.rstrip() for line in lines)


def _percent(share: float) -> str:
    return f"{100 * share:5.1f} %"


def _support_line(found: SupportReport) -> str:
    said = "was captured" if found.supported else "was not captured"
    beyond = ", ".join(
        f"{name} {100 * share:.0f} % of its range beyond it"
        for name, share in found.beyond.items()
        if share
    )
    return (
        f"something like it {said}: variance {found.variance:.2g} of at most {found.limit:.2g}, "
        f"{beyond or 'no control beyond its range'} (at most {100 * found.most:.0f} %)"
    )


def _clip_line(clip: CapturedClip) -> str:
    values = ", ".join(f"{name} {value:g}" for name, value in clip.controls.items())
    return ", ".join([*filter(None, [clip.performer]), *clip.labels.values(), values])


def suggestions(found: Suggestions) -> dict[str, Any]:
    """Return the suggestions in the schema Suggestions of the API."""
    return {
        "model": found.model,
        "performer": found.performer,
        **_labels(found.labels),
        "candidates": found.candidates,
        "suggestions": [
            vars(own) | {n: round(getattr(own, n), DECIMALS) for n in ("gain", "variance", "gap")}
            for own in found.suggestions
        ],
    }


def suggestions_text(found: Suggestions) -> str:
    """Return one line for each point, the largest gain first."""
    rows = [SUGGESTION_HEADING, *map(_suggestion_cells, found.suggestions)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(SUGGESTION_HEADING))]
    lines = ("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def _suggestion_cells(found: Suggestion) -> tuple[str, ...]:
    controls = ", ".join(f"{name} {value:.4g}" for name, value in found.controls.items())
    return (
        f"{100 * found.gain:.1f} %",
        f"{found.variance:.2f}",
        f"{found.lacking} ({100 * found.gap:.0f} % of its range)",
        found.nearest or "",
        controls,
    )
