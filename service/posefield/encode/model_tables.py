"""Answers about a model: sigma grids as tables; reasons and suggestions as JSON and as text."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from posefield.encode import table as tables
from posefield.encode.table import Table
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


def explanation(reasons: Explanation) -> dict[str, Any]:
    """Return the reasons in the schema Reasons of the API."""
    backing = reasons.backing
    return {
        "model": reasons.model,
        "controls": reasons.controls,
        "performer": reasons.performer,
        **_labels(reasons.labels),
        "warnings": list(reasons.warnings),
        "support": {
            "supported": backing.supported,
            "beyond": {name: round(share, DECIMALS) for name, share in backing.beyond.items()},
            "most_beyond": backing.most,
            "variance": round(backing.variance, DECIMALS),
            "most_variance": round(backing.limit, DECIMALS),
        },
        "nearest": [_clip_facts(clip) for clip in reasons.nearest],
        "others": {
            "count": reasons.others,
            "weight": round(reasons.others_weight, DECIMALS),
            "share": round(reasons.others_share, DECIMALS),
        },
        **({"inferred": list(reasons.inferred)} if reasons.inferred else {}),
    }


def _clip_facts(clip: CapturedClip) -> dict[str, Any]:
    rounded = ("distance", "weight", "share")
    values = {name: value for name, value in vars(clip).items() if name != "labels"}
    numbers = {name: round(getattr(clip, name), DECIMALS) for name in rounded}
    return {**values, **numbers, **_labels(clip.labels)}


def _labels(labels: Mapping[str, Any]) -> dict[str, Any]:
    """Return labels by their key; nothing where there are none."""
    return {"labels": dict(labels)} if labels else {}


def explanation_text(reasons: Explanation) -> str:
    """Return one line for each clip, the nearest first, one for all others, and the support."""
    width = max(len("clip"), *(len(clip.source) for clip in reasons.nearest))
    lines = [f"{'clip':{width}}  distance    share     weight  "]
    lines += [
        f"{clip.source:{width}}  {clip.distance:8.3f}  {_percent(clip.share)}   "
        f"{_percent(clip.weight)}  "
        f"{_clip_line(clip)}"
        for clip in reasons.nearest
    ]
    others = f"{reasons.others} others"
    shares = f"{_percent(reasons.others_share)}   {_percent(reasons.others_weight)}"
    lines.append(f"{others:{width}}  {'':8}  {shares}")
    lines.append(_support_line(reasons.backing))
    return "\n".join(line.rstrip() for line in lines)


def _percent(share: float) -> str:
    return f"{100 * share:5.1f} %"


def _support_line(support: SupportReport) -> str:
    verdict = "was captured" if support.supported else "was not captured"
    beyond = ", ".join(
        f"{name} {100 * share:.0f} % of its range beyond it"
        for name, share in support.beyond.items()
        if share
    )
    return (
        f"something like it {verdict}: variance {support.variance:.2g} of at most "
        f"{support.limit:.2g}, "
        f"{beyond or 'no control beyond its range'} (at most {100 * support.most:.0f} %)"
    )


def _clip_line(clip: CapturedClip) -> str:
    values = ", ".join(f"{name} {value:g}" for name, value in clip.controls.items())
    return ", ".join([*filter(None, [clip.performer]), *clip.labels.values(), values])


def suggestions(ranked: Suggestions) -> dict[str, Any]:
    """Return the suggestions in the schema Suggestions of the API."""
    return {
        "model": ranked.model,
        "performer": ranked.performer,
        **_labels(ranked.labels),
        "candidates": ranked.candidates,
        "suggestions": [
            vars(suggestion)
            | {n: round(getattr(suggestion, n), DECIMALS) for n in ("gain", "variance", "gap")}
            for suggestion in ranked.suggestions
        ],
    }


def suggestions_text(ranked: Suggestions) -> str:
    """Return one line for each point, the largest gain first."""
    rows = [SUGGESTION_HEADING, *map(_suggestion_cells, ranked.suggestions)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(SUGGESTION_HEADING))]
    lines = ("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def _suggestion_cells(suggestion: Suggestion) -> tuple[str, ...]:
    controls = ", ".join(f"{name} {value:.4g}" for name, value in suggestion.controls.items())
    return (
        f"{100 * suggestion.gain:.1f} %",
        f"{suggestion.variance:.2f}",
        f"{suggestion.lacking} ({100 * suggestion.gap:.0f} % of its range)",
        suggestion.nearest or "",
        controls,
    )
