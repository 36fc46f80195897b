"""A library: `character.usd`, which has every clip in a layer of its own, by its name."""

from collections.abc import Iterable, Iterator
from typing import Any

from service.encode import ENCODERS, library
from service.export.job import Job, Work, opened
from service.export.query import Query
from service.motion import roles
from service.motion.answer import ClipAnswer

STAGE, FORMAT = "character.usd", "usdc"


def misfit(job: Job, query: Query) -> str | None:
    """Why a query has no place in a library; none if it has."""
    if query.format != FORMAT:
        return f"format: {query.format!r}, expected {FORMAT!r} in a library"
    if query.question.names != job.names:
        return f"names: {query.question.names!r}, expected {job.names!r}: all play one character"
    return None


def describe(name: str, file: str, answer: ClipAnswer) -> dict[str, Any]:
    """Box that the character never leaves in a clip, m, as the stage must know it."""
    entry = library.entry(name, file, answer)
    return {"low": entry.low, "high": entry.high}


def complete(work: Work, entries: Iterable[dict[str, Any]]) -> Iterator[tuple[str, bytes]]:
    """The stage, at the rate of its first clip."""
    job, card = work.job, opened(work).session.card
    clips = [
        library.Entry(*(entry[key] for key in ("name", "file", "frames", "fps", "low", "high")))
        for entry in entries
    ]
    skeleton = roles.renamed(card.skeleton, card.roles, job.names)
    convention = ENCODERS[FORMAT].convention(job.unit, job.up)
    yield STAGE, library.stage(skeleton, convention, clips[0].rate, clips)
