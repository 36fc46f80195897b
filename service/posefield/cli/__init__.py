"""The `posefield` command of the service; the training job adds its own commands.

Exit codes: 0 success; 2 a question or an argument that cannot be answered; 3 a file that cannot be
used; 4 samples from which no model can be made; 5 a process of an export that died; 128 and a
signal's number where that ended an export.
"""

import sys
from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from typing import Annotated, Any

import typer

from posefield import __version__
from posefield.cli import (
    command_bake,
    command_clip,
    command_export,
    command_models,
    command_page,
    command_perform,
    command_serve,
)
from posefield.common.errors import FileError, MotionError, TrainingError, WorkerDied
from posefield.console.registration import (
    ASK,
    HELP_OPTIONS,
    MAKE,
    SERVE,
    PlainGroup,
    example_text,
    register,
)

app = typer.Typer(
    cls=PlainGroup,
    context_settings={"help_option_names": HELP_OPTIONS},
    pretty_exceptions_enable=False,
)

INTERRUPTED = 130
"""Exit code that shells expect after SIGINT."""

# Modules that each extra provides; the first extra with a missing module is told.
EXTRAS = {
    "train": ("posefield_train", "scipy", "onnx", "pydantic", "matplotlib", "joblib"),
    "evaluate": ("sklearn",),
    "dask": ("distributed",),
    "store": ("obstore",),
    "jwt": ("jwt", "cryptography"),
    "parquet": ("pyarrow",),
    "mcp": ("mcp",),
}
TRAINING = {
    "probe": "Propose unit, axes, feet and heading of motion files.",
    "init": "Write a recipe and a table for a folder of motion files.",
    "sample": "Write procedural motions and their recipe.",
    "train": "Train a recipe's model.",
    "adapt": "Add a performer to a trained model.",
    "evaluate": "Measure a model's errors on clips that it has not seen.",
}
"""Commands of posefield-train, which are listed without it too."""


def main() -> None:
    """Run the command line; MotionErrors and missing modules end as one line and an exit code."""
    try:
        _program()()
    except ModuleNotFoundError as fault:
        typer.echo(f"posefield: {_missing(fault.name or '')}", err=True)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except MotionError as fault:
        typer.echo(f"posefield: {fault}", err=True)
        sys.exit(_exit_code(fault))


@cache
def _program() -> Callable[[], Any]:
    """Return the program of all commands, built once in a process.

    Registering the training commands at each call would make every later call slower.
    """
    plugins = entry_points(group="posefield.commands")
    # The container image contains only the service.
    installed = [plugin for plugin in plugins if find_spec(plugin.module.partition(".")[0])]
    for plugin in installed:
        plugin.load()(app)
    if not installed:
        _list_training()
    return typer.main.get_command(app)


def _missing(module: str) -> str:
    """Return the message for a missing module: all missing ones of its extra, and the pip line."""
    extras = [extra for extra, modules in EXTRAS.items() if module.partition(".")[0] in modules]
    if not extras:
        return f"needs {module}, which posefield installs: pip install posefield"
    absent = [name for name in EXTRAS[extras[0]] if not find_spec(name)]
    return f'needs {", ".join(absent)}: pip install "posefield[{extras[0]}]"'


def _list_training() -> None:
    """List the training commands, each of which tells how to install them."""

    def absent(context: typer.Context) -> None:
        raise ModuleNotFoundError(name=EXTRAS["train"][0])

    anything = {"ignore_unknown_options": True, "allow_extra_args": True, "help_option_names": []}
    for name, purpose in TRAINING.items():
        # Rich takes a bare [train] for a style.
        text = f'{purpose} Needs pip install "posefield\\[train]".'
        app.command(name, help=text, context_settings=anything, rich_help_panel=MAKE)(absent)


def _exit_code(fault: MotionError) -> int:
    if isinstance(fault, FileError):
        return 3
    if isinstance(fault, TrainingError):
        return 4
    return 5 if isinstance(fault, WorkerDied) else 2


HELP = (
    "Example motions become one model file, which answers with any motion between them.\n\n"
    "Exit codes: 0 success, 2 a question or an argument cannot be answered, 3 a file cannot be "
    "used, 4 no model can be made of the samples, 5 a process died."
)
COMMANDS: dict[str, tuple[Callable[..., None], str, list[str]]] = {
    "demo": (command_serve.demo, SERVE, ["demo", "demo --once -o clips"]),
    "models": (command_models.models, ASK, ["models", "models my_models --json"]),
    "inspect": (
        command_models.inspect,
        ASK,
        ["inspect walk.onnx", "inspect walk.onnx --json"],
    ),
    "pose": (command_clip.pose, ASK, ["pose walk.onnx -c speed=1.2 --time 0.5 --time 0.6"]),
    "clip": (
        command_clip.clip,
        ASK,
        [
            "clip walk.onnx -c speed=1.2 -o walk.glb",
            "clip walk.onnx -c speed=1.2 --fps 24 -o blender.usdc",
            "clip reach.onnx --target RightHand@end=-0.2,1.1,0.5 -o reach.usda",
        ],
    ),
    "crowd": (
        command_clip.crowd,
        ASK,
        [
            "crowd walk.onnx --count 100 --seconds 5 -o crowd.usd",
            "crowd walk.onnx --camera=-60,1.7,0 -o crowd.usdz",
        ],
    ),
    "perform": (
        command_perform.perform,
        ASK,
        [
            "perform script.json -o performance.usdc",
            "perform script.json --model my_models --plan",
            "perform scripts.jsonl -o performances --format glb",
        ],
    ),
    "why": (command_models.why, ASK, ["why walk.onnx -c speed=1.2 --nearest 5"]),
    "suggest": (command_models.suggest, ASK, ["suggest walk.onnx --count 5"]),
    "export": (
        command_export.export,
        ASK,
        [
            "export walk.onnx queries.csv -o clips",
            "export walk.onnx --grid speed=0.8:1.6:9 --format glb -o sweep",
            "export walk.onnx --sample 10000 --layout tar -o s3://bucket/walks",
        ],
    ),
    "bake": (
        command_bake.bake,
        ASK,
        ["bake walk.onnx --grid speed=0.6:1.8:5 --grid turn=-20:20:5 -o walk_space"],
    ),
    "page": (command_page.page, ASK, ["page walk.onnx -o site"]),
    "serve": (command_serve.serve, SERVE, ["serve", "serve models/ --port 8080"]),
    "mcp": (command_serve.mcp, SERVE, ["mcp my_models -o clips", "mcp --schema"]),
    "key": (command_serve.key, SERVE, ["key anna --model walk >> keys.txt"]),
}
"""Functions of the commands, their groups and examples."""


@app.callback(
    invoke_without_command=True,
    help=HELP,
    epilog=example_text(["clip walk.onnx -c speed=1.2 -o walk.glb", "--install-completion"]),
)
def _version(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="print the version and exit")] = False,
) -> None:
    if version:
        typer.echo(f"posefield {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


for _name, (_function, _group, _examples) in COMMANDS.items():
    register(app, _function, _group, _examples, _name)
