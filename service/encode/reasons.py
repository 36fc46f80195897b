"""Reasons of a result, as plain values and as a text table."""

from typing import Any

from service.motion.answer import Backing, Captured, Reasons

DECIMALS = 9
"""Decimals that do not depend on the machine that inverted the kriging system."""


def plain(found: Reasons) -> dict[str, Any]:
    """Return the reasons in the schema Reasons of the API."""
    return {
        "model": found.model,
        "controls": found.controls,
        "performer": found.performer,
        "warnings": list(found.warnings),
        "support": _backing(found.backing),
        "nearest": [_clip(clip) for clip in found.nearest],
        "others": {"count": found.others, "weight": round(found.others_weight, DECIMALS)},
        **({"inferred": list(found.inferred)} if found.inferred else {}),
    }


def _clip(clip: Captured) -> dict[str, Any]:
    rounded = {name: round(getattr(clip, name), DECIMALS) for name in ("distance", "weight")}
    return {**vars(clip), **rounded}


def _backing(found: Backing) -> dict[str, Any]:
    return {
        "supported": found.supported,
        "beyond": {name: round(share, DECIMALS) for name, share in found.beyond.items()},
        "most_beyond": found.most,
        "variance": round(found.variance, DECIMALS),
        "most_variance": round(found.limit, DECIMALS),
    }


def text(found: Reasons) -> str:
    """Return one line for each clip, the nearest first, one for all others, and the support."""
    wide = max(len("clip"), *(len(clip.source) for clip in found.nearest))
    lines = [f"{'clip':{wide}}  distance   weight  "]
    lines += [
        f"{clip.source:{wide}}  {clip.distance:8.3f}  {100 * clip.weight:6.1f} %  {_said(clip)}"
        for clip in found.nearest
    ]
    others = f"{found.others} others"
    lines.append(f"{others:{wide}}  {'':8}  {100 * found.others_weight:6.1f} %")
    lines.append(_supported(found.backing))
    return "\n".join(line.rstrip() for line in lines)


def _supported(found: Backing) -> str:
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


def _said(clip: Captured) -> str:
    values = ", ".join(f"{name} {value:g}" for name, value in clip.controls.items())
    return f"{clip.performer}, {values}" if clip.performer else values
