"""Training commands: `sample`, `train`, `adapt` and `evaluate`."""

import typer

from model_export.cli import adapting, evaluating, sampling, training


def commands(app: typer.Typer) -> None:
    """Add the training commands to an application."""
    app.command("sample")(sampling.sample)
    app.command("train")(training.train_command)
    app.command("adapt")(adapting.adapt)
    app.command("evaluate")(evaluating.evaluate)
