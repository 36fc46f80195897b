"""Training commands: `fetch`, `sample`, `train`, `adapt` and `evaluate`."""

import typer

from posefield_train.cli import (
    command_adapt,
    command_evaluate,
    command_fetch,
    command_sample,
    command_train,
)


def commands(app: typer.Typer) -> None:
    """Add the training commands to an application."""
    app.command("fetch")(command_fetch.fetch)
    app.command("sample")(command_sample.sample)
    app.command("train")(command_train.train_command)
    app.command("adapt")(command_adapt.adapt)
    app.command("evaluate")(command_evaluate.evaluate)
