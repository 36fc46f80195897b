"""Helpers for small exports: queries in memory, a recording monitor, and folder contents."""

import hashlib
from dataclasses import replace

import orjson

from posefield.batch.job import ExportJob, WorkerInput
from posefield.batch.rows import Row
from posefield.question.motion_question import ClipQuestion

CONTROLS = {"stature": 1.7, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}


class Listed:
    """Source of rows at hand."""

    def __init__(self, rows):
        self.listed = list(rows)
        self.digest = hashlib.sha256(repr(self.listed).encode()).hexdigest()

    def rows(self):
        return iter(self.listed)

    def check(self, query):
        """Accept a query: errors are those of its synthesis."""


class Recorder:
    """Monitor that records its calls, and stops the run after `most` chunks."""

    def __init__(self, most=10**9):
        self.most, self.begun, self.parts, self.notes = most, None, [], []

    def begin(self, total, done):
        self.begun = (total, done)

    def advance(self, part):
        self.parts.append(part)

    def note(self, message):
        self.notes.append(message)

    def stopped(self):
        return len(self.parts) >= self.most


def question(**more):
    """Return a question to the small model, with more fields."""
    return ClipQuestion(controls=CONTROLS, **more)


def queries(count, form="json", fps=30.0):
    """Source of so many clips, each turned a little further than the last."""
    return Listed(
        Row(
            f"clip-{n:04d}",
            form,
            ClipQuestion(controls={**CONTROLS, "turn": 30.0 * n / count}, fps=fps),
            f"line {n + 2}",
        )
        for n in range(count)
    )


def work(model, source, target, chunk=8, layout="folder", **more):
    """Work of a small job."""
    content = model.read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    job = ExportJob(f"{model.stem}@{digest[:16]}", digest, source.digest, layout, chunk)
    return replace(WorkerInput(job, content, str(target)), **more)


def content(folder):
    """Bytes of every file under a folder, by path."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def lines(path):
    """Values of a file of JSON Lines."""
    return [orjson.loads(line) for line in path.read_bytes().splitlines()]
