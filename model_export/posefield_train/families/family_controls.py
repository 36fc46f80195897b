"""Proposed controls of a family, from its clips as training reads them."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from posefield_train.discover import control_proposals
from posefield_train.discover.control_proposals import ControlProposal, FamilyClips
from posefield_train.families import family_table
from posefield_train.families.family_table import FamilyRow
from posefield_train.source import common_topology, ingest, measured_controls, recipe
from posefield_train.source.motion_readers import MotionFiles
from posefield_train.source.recipe import Recipe


def propose(
    text: str,
    name: str,
    rows: Sequence[FamilyRow],
    data: Path,
    known: MotionFiles | None = None,
) -> ControlProposal:
    """Return the proposed controls of a family.

    text: of a recipe with any control. name: of its table without the ending. data: folder of the
    takes. known: files that were read before. Raises RecipeError, BvhError or TrainingError for
    clips that cannot be read as one family, and ValueError for those that no control can be
    proposed for.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / f"{name}.csv").write_bytes(family_table.table(rows))
        (place / f"{name}.toml").write_text(text, encoding="utf-8")
        own = recipe.read(place / f"{name}.toml")
        examples, _ = ingest.ingest(own, data, known)
    found = control_proposals.propose_controls(_family_clips(own, examples))
    if not found.controls:
        raise ValueError("no measure of the clips predicts those of takes that are left out")
    return found


def _family_clips(own: Recipe, examples: Sequence[ingest.Example]) -> FamilyClips:
    names = examples[0].clip.skeleton.names
    roles = {str(role): joint for role, joint in own.roles.items()}
    if own.skeleton.is_unified:
        roles = common_topology.model_roles(names)
    joints: Mapping[str, int] = {
        role: names.index(joint) for role, joint in roles.items() if joint in names
    }
    return FamilyClips(
        tuple(measured_controls.measured_quantities(one.clip) for one in examples),
        joints,
        tuple(one.row.performer for one in examples),
        tuple(one.take for one in examples),
        own.motion.cyclic,
    )
