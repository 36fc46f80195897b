"""Controls that discovery proposes for the clips of shipped recipes, against those by hand."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rows import Row, record, table

from posefield_train.discover import control_proposals
from posefield_train.discover.control_proposals import FamilyClips, RecordingPrediction
from posefield_train.source import data_folder, ingest, measured_controls, recipe

RESULTS = Path(__file__).resolve().parents[1] / "docs/results"
RECIPES = (
    "hdm05_grab_high",
    "hdm05_deposit_floor",
    "hdm05_kick",
    "hdm05_hop",
    "cmu_walk",
    "bandai_raise_hand",
)
PEAK = {"peak_frame": "highest"}
"""Moment of the table of clips that is found as one of the motion."""


@dataclass(frozen=True)
class Proposed:
    """Proposal for the clips of a recipe. lacking: controls by hand that are not proposed.

    remaining: share of the variance of left-out recordings that is left with the proposed controls,
    and with those by hand.
    """

    recipe: str
    by_hand: tuple[str, ...]
    lacking: tuple[str, ...]
    remaining: float
    remaining_by_hand: float


def propose(name: str, data: Path) -> Proposed:
    """Return the proposal for a shipped recipe. data: folder of the data sets."""
    family_recipe = recipe.read(data_folder.RECIPES / f"{name}.toml")
    examples, _ = ingest.ingest(family_recipe, data)
    joints = examples[0].clip.skeleton.names
    motions = [measured_controls.measured_quantities(one.clip) for one in examples]
    performers, recordings = (
        [one.row.performer for one in examples],
        [one.recording for one in examples],
    )
    indices = {str(role): joints.index(joint) for role, joint in family_recipe.roles.items()}
    clips = FamilyClips(
        tuple(motions), indices, tuple(performers), tuple(recordings), family_recipe.motion.cyclic
    )
    proposals = control_proposals.propose_controls(clips)
    controls = {(one.quantity, one.role, one.at) for one in proposals.controls}
    roles = {joint: str(role) for role, joint in family_recipe.roles.items()}
    recipe_controls = {
        control.name: (auto.quantity, roles.get(auto.joint or ""), PEAK.get(auto.at or "", auto.at))
        for control in family_recipe.measured
        if (auto := control.auto)
    }
    values = np.array([one.controls for one in examples])
    standardised = list(((values - values.mean(axis=0)) / values.std(axis=0)).T)
    prediction = RecordingPrediction(
        control_proposals.motion_coefficients(motions), performers, recordings
    )
    lacking = tuple(
        control for control, measure in recipe_controls.items() if measure not in controls
    )
    return Proposed(
        name,
        tuple(recipe_controls),
        lacking,
        proposals.remaining[-1],
        prediction.remaining(standardised),
    )


def row(proposed: Proposed) -> Row:
    """Return the variance that remains; at most that with the controls by hand is wanted."""
    lacking = ", ".join(proposed.lacking) or "none"
    remark = f"by hand: {', '.join(proposed.by_hand)}; not proposed: {lacking}"
    remaining, by_hand = 100.0 * proposed.remaining, 100.0 * proposed.remaining_by_hand
    return Row(f"{proposed.recipe}: variance that remains", remaining, "%", remark, None, by_hand)


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder of the data sets")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    table_rows = [row(propose(name, options.data)) for name in RECIPES]
    print(table(table_rows))
    if options.record:
        command = "python benchmarks/proposed_controls.py DATA --record"
        record({"proposed_controls": table_rows}, command, RESULTS)


if __name__ == "__main__":
    main(sys.argv[1:])
