"""What a performer's name is worth, in two protocols side by side."""

from collections.abc import Sequence
from typing import Any

from model_export.evaluate import summary
from model_export.evaluate.methods import OURS
from model_export.evaluate.newcomers import NOBODY, SHOWN
from model_export.evaluate.protocol import Result
from model_export.report import plain


def facts(results: Sequence[Result]) -> dict[str, Any]:
    """What a name is worth, and how near a model that was shown a few clips of somebody comes to
    one that was trained with all others; nothing where either was not asked for."""
    by_name = {result.protocol: result for result in results}
    clips, others = (by_name.get(f"leave_one_{held}_out") for held in ("clip", "performer"))
    if not clips or not others or NOBODY not in clips.errors:
        return {}
    everyone = clips.asked(NOBODY)
    named, unnamed = (_relative(clips, name, everyone) for name in (OURS, NOBODY))
    shown = {name: _beside(clips, others, name) for name in SHOWN if others.asked(name)}
    return {"named_nearer": plain.number(1.0 - named / unnamed), **shown}


def _beside(clips: Result, others: Result, name: str) -> dict[str, Any]:
    """An adapted model on the clips that it was asked for, beside those that saw none of the
    performer, and all but the clip."""
    places = others.asked(name)
    own, none = (_relative(others, one, places) for one in (name, OURS))
    whole = _relative(clips, OURS, places)
    return {
        "clips": len(places),
        "relative_cm": summary.centimetres(own),
        "shown_none_cm": summary.centimetres(none),
        "shown_all_cm": summary.centimetres(whole),
        "farther_than_all": plain.number(own / whole - 1.0),
    }


def _relative(result: Result, name: str, places: Sequence[int]) -> float:
    return float(summary.relative(result.of(name, places)).mean())


def said(results: Sequence[Result]) -> list[str]:
    """The same in a sentence each."""
    found = facts(results)
    if not found:
        return []
    return [
        f"named, a performer is met {100 * found['named_nearer']:.1f} % nearer than unnamed",
        *(
            f"{name}: {one['relative_cm']:.2f} cm on {one['clips']} clips, "
            f"{100 * one['farther_than_all']:+.1f} % beside {one['shown_all_cm']:.2f} cm of a "
            f"model trained with all others; shown none {one['shown_none_cm']:.2f} cm"
            for name in SHOWN
            if (one := found.get(name))
        ),
    ]
