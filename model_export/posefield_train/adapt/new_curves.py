"""Curves of new clips for a trained model: where their files are, and the clips with them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from posefield.common.errors import RecipeError
from posefield.model_file.model_card import ModelCard
from posefield.motion.clip import Clip
from posefield_train.source import curve_files, ingest
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.motion_file import MotionFile
from posefield_train.source.recipe_sections import Source

COLUMN, SUFFIX = "curves", ".curves.csv"
"""Column of a table with the file of a clip's curves, and how it ends beside a motion file."""


@dataclass(frozen=True)
class NewFiles:
    """Conventions of the files of new clips.

    source: of motion files. rate: frames a second of files of curves without a skeleton.
    """

    source: Source
    rate: float | None = None


def are_alone(card: ModelCard) -> bool:
    """Return whether the clips of a model are curves without a skeleton."""
    return bool(card.curves) and card.skeleton.names == (curve_files.RESTING_JOINT,)


def have_files(card: ModelCard) -> bool:
    """Return whether clips of a model have a file of curves beside their motion file."""
    return bool(card.curves) and not are_alone(card)


def place_beside(card: ModelCard, motion: Path) -> Path | None:
    """Return the file of curves beside a motion file; None for a model without such files.

    Raises RecipeError if there is none.
    """
    if not have_files(card):
        return None
    place = motion.with_suffix(SUFFIX)
    if not place.is_file():
        raise RecipeError(
            str(motion),
            f"found no {place.name} beside it, expected the file of its curves, which the model "
            f"has; or a table with a column {COLUMN!r}",
        )
    return place


def whole_clip(
    card: ModelCard, row: ClipRow, files: Mapping[str, MotionFile], conventions: NewFiles
) -> tuple[Clip, list[str]]:
    """Return the clip of all frames of a row with the model's curves, and notes.

    files: motion files by place. Raises RecipeError for curves that do not fit the model or the
    motion, and without a rate where files have none.
    """
    if not card.curves:
        return ingest.clip_of_file(files[row.motion], conventions.source), []
    values, others = curve_files.read_known(row.curve_file, card.curves)
    said = f"{row.curve_file}: curves {others}, which the model does not have, were left out"
    notes = [said] if others else []
    if not are_alone(card):
        clip = ingest.clip_of_file(files[row.motion], conventions.source)
        return curve_files.with_curves(clip, values, row), notes
    if conventions.rate is None:
        raise row.error("nothing says the frames a second of its curves, expected --rate")
    return curve_files.resting_clip(values, conventions.rate), notes
