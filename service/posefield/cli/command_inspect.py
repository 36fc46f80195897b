"""The `posefield inspect` command: summary of a model file."""

from typing import Any

import typer

from posefield.console.arguments import Json, ModelPath
from posefield.console.late_progress import LateProgress
from posefield.console.output import as_json
from posefield.inference import cost_model, session
from posefield.model_file import model_card as cards
from posefield.motion import measures


def inspect(model: ModelPath, json: Json = False) -> None:
    """Print a model's controls, levels of detail, errors and licence.

    The time per pose is measured on this machine.
    """
    opened = session.load(model)
    with LateProgress("rounds of timing") as bar:
        seconds = cost_model.seconds_per_pose(opened, bar.update)
    plain = {
        "identity": f"{model.stem}@{opened.digest}",
        **cards.plain_values(opened.card),
        "seconds_per_pose": seconds,
    }
    typer.echo(as_json(plain) if json else _summary(plain))


def _summary(plain: dict[str, Any]) -> str:
    """Return a summary of a model card, within one screen."""
    diagnostics = plain["diagnostics"]
    levels = zip(plain["levels"], plain["seconds_per_pose"], strict=True)
    lines = [
        f"{plain['identity']}: {plain['description']}",
        f"{plain['samples']} clips of {len(plain['skeleton']['names'])} joints, "
        f"{plain['durations'][0]:.2f} to {plain['durations'][1]:.2f} s, {plain['root']}"
        f"{', cyclic' if plain['cyclic'] else ''}",
        f"ranks {plain['levels'][0]['ranks']} of {diagnostics['tensor']}: truncation costs "
        f"{100 * diagnostics['truncation_rms_m']:.2f} cm, a clip left out lies "
        f"{100 * diagnostics['leave_one_out_rms_m']:.2f} cm away (root mean square over joints)",
        f"levels of detail, times in batches of {cost_model.ROWS_PER_CALL}:",
        *(_level(number, *level) for number, level in enumerate(levels)),
        "controls:",
        *(_control(control, plain["skeleton"]["names"]) for control in plain["controls"]),
        *map(_curve, plain.get("curves", [])),
        *_contacts(plain),
        *_accelerations(plain),
        *(f"{own['name']}s: {', '.join(own['names'])}" for own in plain["labels"]),
        f"licence: {plain['provenance']['licence']}",
        *(f"note: {note}" for note in diagnostics["notes"]),
    ]
    return "\n".join(lines)


def _level(number: int, level: dict[str, Any], seconds: float) -> str:
    return (
        f"  {number}: ranks {level['ranks']} of {level['samples']} clips, {level['numbers']} "
        f"numbers, {level['operations']} multiply-adds a pose, off by {100 * level['rms']:.2f} cm, "
        f"the worst pose by {100 * level['pose']:.1f} cm, here {1e6 * seconds:.2f} µs a pose"
    )


def _curve(plain: dict[str, Any]) -> str:
    """Return one line on a curve: its limits, and the distance that one unit counts as."""
    span = f"{plain['minimum']:g} to {plain['maximum']:g}"
    return f"curve {plain['name']}: {span}, a unit counts as {100 * plain['distance']:g} cm"


def _contacts(plain: dict[str, Any]) -> list[str]:
    """Return a line on each joint with contacts, and one on the accuracy of the contacts."""
    names, accuracy = plain["skeleton"]["names"], plain["diagnostics"].get("contacts")
    found = [
        f"contacts of {names[own['joint']]}: {100 * own['height']:.1f} cm high, swings of "
        f"{own['swing']:.2f} s, at most {own['longest_swing']:.2f} s in nine of ten, lifted by "
        f"{100 * own['clearance']:.1f} cm"
        for own in plain.get("contacts", [])
    ]
    if accuracy:
        found.append(
            f"contacts of clips left out: {accuracy['agreement']:.0%} of frames agree, Brier score "
            f"{accuracy['brier']:.3f}, {accuracy['climatology']:.3f} by the mean of the others"
        )
    return found


def _accelerations(plain: dict[str, Any]) -> list[str]:
    """Return a line on the accelerations of the captured clips, if the card has them."""
    own = plain.get("captured_acceleration")
    if own is None:
        return []
    return [
        "accelerations of the joints relative to the root in the captured clips: median "
        f"{own['median']:.1f} m/s², 99th percentile {own['p99']:.1f} m/s²"
    ]


def _control(plain: dict[str, Any], joints: list[str]) -> str:
    """Return one line on a control: its sampled range, its description and its measure."""
    span = f"{plain['minimum']:g} to {plain['maximum']:g} {plain['unit']}"
    own = plain.get("measure")
    how = f" (measured: {measures.describe(measures.from_dict(own), joints)})" if own else ""
    return f"  {plain['name']}: {span}, {plain['description']}{how}"
