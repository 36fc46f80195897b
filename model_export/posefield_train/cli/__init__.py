"""Training commands: `probe`, `init`, `discover`, `review`, `train` and others."""

from collections.abc import Callable

import typer

from posefield.console.registration import MAKE, register
from posefield_train.cli import (
    command_adapt,
    command_discover,
    command_doctor,
    command_evaluate,
    command_feasibility,
    command_probe,
    command_sample,
    command_train,
)

COMMANDS: dict[str, tuple[Callable[..., None], list[str]]] = {
    "probe": (command_probe.probe, command_probe.PROBE_EXAMPLES),
    "init": (command_probe.init, command_probe.INIT_EXAMPLES),
    "convert": (command_sample.convert, command_sample.CONVERT_EXAMPLES),
    "discover": (command_discover.discover, command_discover.EXAMPLES),
    "review": (command_discover.review, command_discover.REVIEW_EXAMPLES),
    "doctor": (command_doctor.doctor, command_doctor.EXAMPLES),
    "feasibility": (command_feasibility.feasibility, command_feasibility.EXAMPLES),
    "sample": (
        command_sample.sample,
        ["sample reaching -o reaching", "sample reaching --truth -c turn=20 -o truth.bvh"],
    ),
    "train": (
        command_train.train_command,
        [
            "train kick/recipe.toml -o kick.onnx --report kick.html",
            "train cmu_walk --data motion -o walk.onnx",
        ],
    ),
    "adapt": (
        command_adapt.adapt,
        [
            "adapt walk.onnx kim.bvh -o walk_kim.onnx --performer kim "
            "--unit 0.01 --up y --licence CC0-1.0"
        ],
    ),
}
"""Functions of the commands and their examples."""


def commands(app: typer.Typer) -> None:
    """Add the training commands to an application."""
    for name, (function, examples) in COMMANDS.items():
        register(app, function, MAKE, examples, name)
    command_evaluate.add(app)
