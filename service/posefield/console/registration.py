"""Registration of commands: groups, examples, and the form of their help."""

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, get_args

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

MAKE, ASK, SERVE = "Make a model", "Ask a model", "Serve models"
GROUPS = (MAKE, ASK, SERVE)
"""Groups of commands, in the order of the help."""
HELP_OPTIONS = ["-h", "--help"]
PLACEHOLDERS = {bool: "", int: "N", float: "NUMBER", Path: "PATH"}
"""Placeholder of an option's value by its type, if the option names none; TEXT for others."""


class PlainArgument(TyperArgument):
    """Argument whose help has no column with the Python type."""

    def display_type_rich(self, ctx: Any) -> None:
        """Return None, no type: the name and the text say it."""


def _tidy(params: Sequence[Any]) -> list[Any]:
    """Return the parameters of a command with placeholders in place of Python types."""
    for param in params:
        if isinstance(param, TyperArgument):
            # Typer makes the arguments itself and takes no class for them.
            param.__class__ = PlainArgument
        elif param.metavar is None and not param.type_descriptor.is_choice:
            kind = param.type_descriptor.annotation
            kind = (get_args(kind) or (kind,))[0]
            param.metavar = PLACEHOLDERS.get(kind, "TEXT")
    return list(params)


class PlainCommand(TyperCommand):
    """Command whose help names values by placeholders."""

    def get_params(self, ctx: typer.Context) -> list[Any]:  # type: ignore[override]
        """Return the parameters and the help option."""
        return _tidy(super().get_params(ctx))


class PlainGroup(TyperGroup):
    """Group whose help names values by placeholders and lists its commands by group."""

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """Return the names of the commands, those of one group together."""
        groups = {
            name: getattr(self.commands[name], "rich_help_panel", "") for name in self.commands
        }
        names = [name for name in groups if groups[name] in GROUPS]
        return sorted(names, key=lambda name: GROUPS.index(groups[name])) + [
            name for name in groups if name not in names
        ]

    def get_params(self, ctx: typer.Context) -> list[Any]:  # type: ignore[override]
        """Return the parameters and the help option."""
        return _tidy(super().get_params(ctx))


def register(
    app: typer.Typer,
    command: Callable[..., None],
    group: str,
    examples: Sequence[str],
    name: str | None = None,
    cls: type[PlainCommand] = PlainCommand,
) -> None:
    """Add a command to an application.

    group: heading of the command in the list of commands. examples: command lines without
    "posefield". name: of the command; None for the name of the function.
    """
    add = app.command(
        name,
        cls=cls,
        help=plain_help(command),
        epilog=example_text(examples),
        rich_help_panel=group,
        context_settings={"help_option_names": HELP_OPTIONS},
    )
    add(command)


def plain_help(command: Callable[..., Any]) -> str:
    """Return a docstring with one line for each paragraph; the terminal breaks lines."""
    paragraphs = (inspect.getdoc(command) or "").split("\n\n")
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


def example_text(examples: Sequence[str]) -> str:
    """Return the end of a help text with examples, a line each."""
    return "\n".join(["Examples:", "", *(f"  posefield {line}" for line in examples)])
