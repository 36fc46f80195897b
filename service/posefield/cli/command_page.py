"""The `page` command: the web page with computed answers of a model, as one file."""

import math
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Annotated, Any

import typer

from posefield.answer_table import accuracy, interpolated_answers, row_compression
from posefield.answer_table.accuracy import Accuracy
from posefield.answer_table.interpolated_answers import AnswerTable
from posefield.common import atomic_files
from posefield.common.errors import FileError
from posefield.console.arguments import Json, ModelPath
from posefield.console.late_progress import LateProgress
from posefield.console.output import as_json
from posefield.encode import character_file
from posefield.inference import session
from posefield.inference.session import Session
from posefield.model_file import checked_file, model_card
from posefield.question import results

VIEWER_PAGE = Path(__file__).parents[1] / "http/pages/viewer/index.html"
_BODY_END = b"</body>"


def page(
    model: ModelPath,
    output: Annotated[Path, typer.Option("--output", "-o", help="output file, HTML")],
    answers: Annotated[
        int,
        typer.Option(
            min=1,
            help="largest number of computed answers for each level of detail; those at the ends "
            "of the ranges are always there",
        ),
    ] = interpolated_answers.MAX_ROWS,
    json: Json = False,
) -> None:
    """Write the viewer page of a model as one file, without a service.

    The page holds computed answers and interpolates between them. Fewer answers make a smaller
    file and larger errors.
    """
    if output.is_dir():
        raise FileError(output, "is a folder, expected the name of a file")
    before = built_page(VIEWER_PAGE)
    opened = session.load_bytes(checked_file.read(model), str(model))
    with LateProgress("answers", len(opened.card.levels) + 1) as bar:
        found = interpolated_answers.build(opened, answers, bar.update)
        errors = accuracy.measure(opened, found)
    identity = f"{model.stem}@{opened.digest}"
    content = page_content(before, copy_data(opened, identity, found, errors), identity)
    atomic_files.write(content, output)
    facts = {"model": identity, "file": str(output), "bytes": len(content)}
    if json:
        typer.echo(as_json({**facts, "answers": found.answers, "errors": asdict(errors)}))
        return
    typer.echo(f"{output}: {identity}, {len(content) / 1e6:.1f} MB; any browser opens it")
    typer.echo(f"  {described(found, errors)}")


def described(found: AnswerTable, errors: Accuracy) -> str:
    """Return a sentence on the answers of a copy and their errors."""
    worst, beyond, typical = (
        f"{100 * value:.1f} cm" for value in (errors.worst, errors.beyond, errors.typical)
    )
    curves = f", curves {100 * errors.curves:.1f} % of their range" if found.card.curves else ""
    return (
        f"interpolated between {found.answers:,} answers; at {errors.points:,} others, joints lie "
        f"at most {worst} off ({typical} in the median), {beyond} outside the sampled ranges"
        f"{curves}"
    )


def copy_data(opened: Session, identity: str, found: AnswerTable, errors: Accuracy) -> str:
    """Return the text from which a copy of the page answers.

    Tables, numbers, and the model's character at rest, which the page draws.
    """
    body = character_file.character_glb(opened.card.skeleton, identity)
    tables: dict[str, Any] = {
        "card": {"identity": identity, **model_card.plain_values(opened.card)},
        "bands": [*results.BANDS, (results.band(math.inf), None)],
        "accuracy": asdict(errors),
        "answers": found.head,
        "character": {"offset": sum(map(len, found.contents)), "size": len(body)},
    }
    return row_compression.pack(tables, [*found.contents, body])


def page_content(before: bytes, data: str, identity: str) -> bytes:
    """Return the page with a copy's data at the end of its body.

    Not in its head: browsers look for the encoding in the first kilobyte.
    """
    kind = f'type="application/octet-stream" id="posefield-copy" data-identity="{escape(identity)}"'
    mark = f"<script {kind}>{data}</script>"
    start, end, rest = before.rpartition(_BODY_END)
    return start + mark.encode() + end + rest


def built_page(path: Path) -> bytes:
    """Return the page that `make page` has built; FileError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as fault:
        said = f"cannot be read: {fault.strerror}; in a copy of the sources `make page` builds it"
        raise FileError(path, said) from fault
