"""Output of commands: answers as JSON and as text."""

from pathlib import Path
from typing import Any

import orjson
import typer

from posefield.question.results import ClipAnswer, Explanation, Trust, band


def as_json(value: Any) -> str:
    """Return plain values as indented JSON."""
    return orjson.dumps(value, option=orjson.OPT_INDENT_2).decode()


def written_message(path: Path, answer: ClipAnswer, json: bool) -> str:
    """Return the message about a written clip, as JSON or as text."""
    frames = len(answer.clip)
    if json:
        facts = answer.trust.document()
        return as_json({"file": str(path), "frames": frames, "rate": answer.clip.rate, **facts})
    return (
        f"{path}: {frames} frames at {answer.clip.rate:g} a second, {answer.trust.duration:.2f} s, "
        f"give or take {100 * answer.trust.sigma:.1f} cm ({band(answer.trust.sigma)})"
    )


def print_warnings(found: Trust | Explanation) -> None:
    """Print inferred controls and warnings on standard error."""
    if found.inferred:
        chosen = " ".join(f"{name}={found.controls[name]!r}" for name in found.inferred)
        typer.echo(f"inferred: {chosen}, most typical for what was given", err=True)
    for warning in found.warnings:
        typer.echo(f"warning: {warning}", err=True)
