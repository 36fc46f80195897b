"""Pages generated from the code: settings, commands, problems and table columns."""

import ast
import html
import inspect
import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, Literal, get_args, get_origin

import typer
from data_pages import contract, schema_text
from page_parts import choices, code, page, table

from posefield import cli
from posefield.batch.tables import OPTION_COLUMNS
from posefield.http import static_page
from posefield.http.api.settings import PREFIX, Settings
from posefield.question import text_decoding
from posefield.question.motion_question import NamedClipQuestion
from posefield_train.cli import commands as add_training_commands

SETTINGS_INTRO = """\
The service reads its settings once, from environment variables. Options of `posefield serve` take
precedence. A value that cannot be used ends the start with exit code 2 and a sentence. Limits are
maxima; times are in seconds, sizes in bytes."""
SETTINGS_SECTIONS = (
    "Process",
    "Sizes",
    "Work of a request",
    "Models",
    "Characters",
    "Host names",
    "Access",
)
"""Headings of the paragraphs of the docstring of Settings that describe settings."""
COMMANDS_INTRO = """\
`posefield COMMAND --help` prints the same. `train`, `sample`, `adapt` and `evaluate` need `pip
install "posefield[train]"`."""
EXIT_CODES = (
    (0, "done"),
    (2, "a question or an argument that cannot be answered"),
    (3, "a file that cannot be used"),
    (4, "samples from which no model can be made"),
    (5, "a worker process died"),
    ("130, 143", "interrupted by SIGINT or SIGTERM"),
)
PROBLEMS_INTRO = """\
Errors are `application/problem+json` (RFC 9457). `type` is stable: `urn:posefield:problem:` and
the name below. `detail` is for people, `errors` names each field at fault by `parameter` or
`pointer`. A running service shows this page at `/problems`."""
COLUMNS_INTRO = """\
A table of queries for `posefield export` is CSV, JSON Lines or Parquet. It may have
one column for each control of the model, by the control's name, one for each label set besides
`performer`, by its name, such as `style`, and the columns below. A label is a name, or weights
of several: `angry:0.7,happy:0.3`. A name of a control may state the unit: `speed [m/s]`. A
control without a value is left open, as over HTTP; any other empty cell takes the option of the
command. The table of a training is described by its [recipe](../guide/recipes.md#the-table)."""
MANIFEST_INTRO = """\
Each line of `manifest.jsonl` is one clip. The fields from `model` on are those of the answer's
[trust](../guide/answers.md)."""
COLUMN_HELP = {
    "format": "format of this row's file",
    "name": "name of the file, without ending; default: the number of the row",
}
MANIFEST_HELP = {
    "name": "Name of the clip.",
    "bytes": "Size of the file.",
    "frames": "Number of frames.",
    "fps": "Frame rate, frames a second.",
}


def settings() -> str:
    """Return the page of the service's settings."""
    ranges = dict(_setting_ranges())
    defaults = {each.name: each.default for each in fields(Settings)}
    parts = [SETTINGS_INTRO]
    paragraphs = inspect.cleandoc(Settings.__doc__ or "").split("\n\n")[2:]
    for heading, paragraph in zip(SETTINGS_SECTIONS, paragraphs, strict=True):
        rows = []
        for names, text in _setting_texts(paragraph):
            for name in names:
                default = defaults.pop(name)
                shown = int(default) if isinstance(default, bool) else default
                variable = code(PREFIX + name.upper())
                rows.append((variable, code(shown), ranges.get(name, ""), text))
        parts += [f"## {heading}", table(("variable", "default", "range", "meaning"), rows)]
    if defaults:
        raise SystemExit(f"settings that the docstring of Settings does not describe: {defaults}")
    return page("Settings", "service/posefield/http/api/settings.py", parts)


def _setting_texts(paragraph: str) -> Iterator[tuple[list[str], str]]:
    """Yield names and text of each description in a paragraph: `a, b: text. c: text.`"""
    line = " ".join(paragraph.split())
    pieces = re.split(r"(?:^|(?<=\. ))((?:[a-z_]+, )*[a-z_]+): ", line)[1:]
    for names, text in zip(pieces[::2], pieces[1::2], strict=True):
        yield names.split(", "), text.strip().rstrip(".")


def _setting_ranges() -> Iterator[tuple[str, str]]:
    """Yield name and range of each setting that is checked against one."""
    for node in ast.walk(ast.parse(inspect.getsource(inspect.getmodule(Settings)))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "_check_range":
            if len(node.args) == 4 and isinstance(node.args[0], ast.Constant):
                low, high = (_number(arg) for arg in node.args[2:])
                yield str(node.args[0].value), f"{low} to {high}"


def _number(node: ast.expr) -> int:
    """Return the value of a constant expression such as 64 * 1024."""
    return int(eval(compile(ast.Expression(node), "settings", "eval"), {"__builtins__": {}}))


def commands() -> str:
    """Return the page of all commands, in the order of `posefield --help`."""
    add_training_commands(cli.app)
    found: Any = typer.main.get_command(cli.app)
    parts = [COMMANDS_INTRO, "## Exit codes", table(("code", "meaning"), EXIT_CODES)]
    for name, command in found.commands.items():
        if not command.hidden:
            parts += [f"## posefield {name}", *_command_parts(name, command)]
    return page("Commands", "the typer application", parts)


def _command_parts(name: str, command: Any) -> Iterator[str]:
    own = [each for each in command.params if each.name != "help"]
    arguments = [each for each in own if not each.opts[0].startswith("-")]
    usage = " ".join(["posefield", name, *map(_placeholder, arguments), "[OPTIONS]"])
    yield f"`{usage}`"
    yield inspect.cleandoc(command.help or "")
    rows = [(_words(each), choices(_kind(each)), _default(each), each.help or "") for each in own]
    if rows:
        yield table(("argument or option", "value", "default", "meaning"), rows)


def _placeholder(argument: Any) -> str:
    name = _argument_name(argument) + ("..." if argument.nargs == -1 else "")
    return name if argument.required else f"[{name}]"


def _argument_name(argument: Any) -> str:
    return (argument.metavar or argument.name.upper()).strip("[].")


def _words(parameter: Any) -> str:
    if not parameter.opts[0].startswith("-"):
        return code(_argument_name(parameter))
    return ", ".join(map(code, (*parameter.opts, *parameter.secondary_opts)))


def _kind(parameter: Any) -> str:
    """Return the value that an option takes: its placeholder, its choices or its type."""
    if getattr(parameter, "is_flag", False):
        return ""
    if parameter.metavar and parameter.opts[0].startswith("-"):
        return str(parameter.metavar)
    annotation = parameter.type_descriptor.annotation
    if get_origin(annotation) is Literal:
        return "|".join(map(str, get_args(annotation)))
    inner = get_args(annotation) or (annotation,)
    return str(getattr(inner[0], "__name__", inner[0])).lower()


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    default = parameter.default
    shown = default is not None and default is not False and default not in ((), [])
    return code(default) if shown and not callable(default) else ""


def problems() -> str:
    """Return the page of all kinds of problems, by status."""
    entries = re.findall(
        r'<dt id="(.+?)">(\d+) .*?<dd>(.+?)</dd>',
        static_page.PROBLEMS.read_text("utf-8"),
        re.DOTALL,
    )
    rows = [
        (status, code(name), re.sub("</?code>", "`", html.unescape(text)))
        for name, status, text in entries
    ]
    parts = [PROBLEMS_INTRO, table(("status", "name", "title and remedy"), rows)]
    return page("Problems", "service/posefield/http/pages/problems.html", parts)


def columns() -> str:
    """Return the page of the columns of tables, and of the fields of a manifest."""
    known = {each.field: each for each in text_decoding.parameters(NamedClipQuestion).values()}
    rows = []
    for name in OPTION_COLUMNS:
        parameter = known.get(name)
        text = COLUMN_HELP.get(name) or (parameter.help if parameter else "")
        if not text:
            raise SystemExit(f"the column {name} has no description")
        rows.append((code(name), text))
    return page(
        "Table columns",
        "service/posefield/batch/tables.py and api/openapi.yaml",
        [COLUMNS_INTRO, table(("column", "meaning"), rows), "## Manifest", *_manifest_parts()],
    )


def _manifest_parts() -> Iterator[str]:
    found = contract()
    properties = found["components"]["schemas"]["ManifestEntry"]["properties"]
    trust = found["components"]["schemas"]["Trust"]["properties"]
    yield MANIFEST_INTRO
    rows = []
    for name, value in properties.items():
        text = schema_text(found, trust.get(name, {})) or schema_text(found, value)
        rows.append((code(name), text or MANIFEST_HELP[name]))
    yield table(("field", "meaning"), rows)
