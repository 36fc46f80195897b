"""The `posefield` command of the service; the training job adds its own commands.

Exit codes: 0 success; 1 `check` found defects; 2 a question or an argument that cannot be answered;
3 a file that cannot be used; 4 samples from which no model can be made; 5 a process of an export
that died; 128 and a signal's number where that ended an export.
"""

import sys
from importlib.metadata import entry_points
from importlib.util import find_spec
from typing import Annotated

import typer

from posefield import __version__
from posefield.cli import (
    command_check,
    command_clip,
    command_crowd,
    command_demo,
    command_export,
    command_inspect,
    command_models,
    command_page,
    command_serve,
    command_why,
)
from posefield.common.errors import FileError, MotionError, TrainingError, WorkerDied

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

INTERRUPTED = 130
"""Exit code that shells expect after SIGINT."""

# Modules that each extra provides; the first extra with a missing module is told.
EXTRAS = {
    "train": ("posefield_train", "scipy", "onnx", "pydantic", "matplotlib"),
    "evaluate": ("joblib", "sklearn"),
    "dask": ("distributed",),
    "store": ("obstore",),
    "jwt": ("jwt", "cryptography"),
    "trace": ("opentelemetry",),
    "parquet": ("pyarrow",),
}
TRAINING = {
    "fetch": "Convert downloaded motion data for a shipped recipe.",
    "sample": "Write procedural motions and their recipe.",
    "train": "Train a recipe's model.",
    "adapt": "Add a performer to a trained model.",
    "evaluate": "Measure a model's errors on clips that it has not seen.",
}
"""Commands of posefield-train, which are listed without it too."""


def main() -> None:
    """Run the command line; MotionErrors and missing modules end as one line and an exit code."""
    plugins = entry_points(group="posefield.commands")
    # The container image contains only the service.
    found = [plugin for plugin in plugins if find_spec(plugin.module.partition(".")[0])]
    for plugin in found:
        plugin.load()(app)
    if not found:
        _list_training()
    try:
        app()
    except ModuleNotFoundError as fault:
        typer.echo(f"posefield: {_missing(fault.name or '')}", err=True)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except MotionError as fault:
        typer.echo(f"posefield: {fault}", err=True)
        sys.exit(_exit_code(fault))


def _missing(module: str) -> str:
    """Return the message for a missing module: all missing ones of its extra, and the pip line."""
    own = [extra for extra, modules in EXTRAS.items() if module.partition(".")[0] in modules]
    if not own:
        return f"needs {module}, which posefield installs: pip install posefield"
    absent = [name for name in EXTRAS[own[0]] if not find_spec(name)]
    return f'needs {", ".join(absent)}: pip install "posefield[{own[0]}]"'


def _list_training() -> None:
    """List the training commands, each of which tells how to install them."""

    def absent(context: typer.Context) -> None:
        raise ModuleNotFoundError(name=EXTRAS["train"][0])

    anything = {"ignore_unknown_options": True, "allow_extra_args": True, "help_option_names": []}
    for name, purpose in TRAINING.items():
        text = f'{purpose} Needs pip install "posefield[train]".'
        app.command(name, help=text, context_settings=anything)(absent)


def _exit_code(fault: MotionError) -> int:
    if isinstance(fault, FileError):
        return 3
    if isinstance(fault, TrainingError):
        return 4
    return 5 if isinstance(fault, WorkerDied) else 2


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="print the version and exit")] = False,
) -> None:
    if version:
        typer.echo(f"posefield {__version__}")
        raise typer.Exit


app.command()(command_demo.demo)
app.command()(command_models.models)
app.command()(command_inspect.inspect)
app.command()(command_clip.pose)
app.command()(command_clip.clip)
app.command()(command_crowd.crowd)
app.command()(command_why.why)
app.command()(command_why.suggest)
app.command()(command_export.export)
app.command()(command_page.page)
app.command()(command_serve.serve)
app.command()(command_serve.key)
app.command()(command_check.check)
