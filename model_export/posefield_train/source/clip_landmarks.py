"""Landmarks and contacts of clips: frames of the file as shares of a clip."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from posefield.motion.clip import Clip
from posefield_train.source import measured_controls
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.recipe import Recipe

Spans = tuple[tuple[float, float], ...]
"""Intervals of shares of a clip."""


def landmarks(row: ClipRow, last: int, columns: Sequence[str]) -> tuple[float, ...]:
    """Return the landmarks of a row as fractions of its clip.

    last: its last frame in the file. columns: of the landmarks. Raises RecipeError for a landmark
    out of the clip, and for two that do not rise.
    """
    named = [*zip(columns, row.landmarks, strict=True)]
    for column, frame in named:
        if not row.first_frame < frame < last:
            raise row.error(
                f"column {column!r}: frame {frame} is out of the clip, expected one between its "
                f"frames {row.first_frame} and {last} of {row.place.name}, without these two"
            )
    for (before, earlier), (column, later) in pairwise(named):
        if later <= earlier:
            raise row.error(
                f"column {column!r}: frame {later}, expected one after frame {earlier} of column "
                f"{before!r}, as in clips.landmarks"
            )
    return tuple((frame - row.first_frame) / (last - row.first_frame) for frame in row.landmarks)


def found_landmark(recipe: Recipe, row: ClipRow, clip: Clip) -> tuple[float, ...]:
    """Return the moment of the recipe's event as a share of the clip, if it is found there."""
    if recipe.event is None or not recipe.event.is_found:
        return ()
    joint = clip.skeleton.names.index(recipe.event.joint)
    share = measured_controls.moment_share(clip, joint, recipe.event.at)
    return (event_landmark(row, recipe.event.joint, recipe.event.at, share),)


def event_landmark(row: ClipRow, joint: str, at: str, share: float) -> float:
    """Return the share of the clip of a row at which its event is.

    Raises RecipeError for an end of the clip, which alignment cannot move.
    """
    if 0.0 < share < 1.0:
        return share
    end = "start" if share == 0.0 else "end"
    raise row.error(
        f"{joint} is {at} at the {end} of {row.place.name}, expected a moment within the clip: cut "
        f"it longer, set event.at to '{end}', or name a column of clips.landmarks"
    )


def expect_same_order(
    names: Sequence[str], rows: Sequence[ClipRow], landmarks: Sequence[tuple[float, ...]]
) -> None:
    """Raise RecipeError for a clip whose event lies between other landmarks than elsewhere.

    names: of the landmarks. landmarks: of each row, as shares of its clip.
    """
    expected = np.argsort(landmarks[0]).tolist()
    for row, marks in zip(rows, landmarks, strict=True):
        order = np.argsort(marks).tolist()
        if order != expected or len(set(marks)) < len(marks):
            found = ", ".join(f"{names[mark]} at {marks[mark]:.0%}" for mark in order)
            raise row.error(
                f"found {found} of {row.place.name}, expected the order of line "
                f"{rows[0].line}, {', '.join(names[i] for i in expected)}"
            )


def contact_spans(row: ClipRow, last: int, columns: Mapping[str, str]) -> dict[str, Spans]:
    """Return the contacts of a row by joint, first and last share of its clip.

    last: its last frame in the file. A contact lasts from half a frame before its first frame to
    half a frame behind its last.
    """
    first, steps = row.first_frame, last - row.first_frame
    return {
        joint: tuple(
            ((begin - 0.5 - first) / steps, (end + 0.5 - first) / steps)
            for begin, end in row.contacts[column]
        )
        for joint, column in columns.items()
    }
