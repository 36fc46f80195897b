"""Examples from files of new clips, checked against the model card of a trained model.

Controls with a measure on the card are measured from the clip; all others come from a table.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from posefield.common.errors import RecipeError, did_you_mean
from posefield.common.units import Floats
from posefield.model_file.model_card import PERFORMER, Control, ModelCard
from posefield.motion import measures
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.adapt.model_reconstruction import ReconstructedModel
from posefield_train.source import (
    canonical,
    clip_joints,
    clip_table,
    curve_files,
    data_folder,
    facing,
    ingest,
    measured_controls,
    skeleton_checks,
)
from posefield_train.source.clip_table import ClipRow, ClipTable
from posefield_train.source.control_sources import TIME_NAMES
from posefield_train.source.data_folder import FileLocation
from posefield_train.source.ingest import Example
from posefield_train.source.motion_file import MotionFile
from posefield_train.source.recipe_sections import Source

COLUMN, SUFFIX = "curves", ".curves.csv"
"""Column of a table with the file of a clip's curves, and how it ends beside a motion file."""

Labels = Mapping[str, str]
"""Names of clips by label set."""


@dataclass(frozen=True)
class NewFiles:
    """Conventions of the files of new clips.

    source: of motion files. rate: frames a second of files of curves without a skeleton.
    """

    source: Source
    rate: float | None = None


def examples_of_files(
    reopened: ReconstructedModel,
    paths: Sequence[Path],
    source: Source,
    labels: Labels,
    rate: float | None = None,
) -> tuple[list[Example], list[str]]:
    """Return examples of whole files, with all controls measured, and notes on assumptions.

    labels: name of all clips in each label set; the performer's is required. Curves are in a file
    beside each motion file, as `SUFFIX` says. rate: frames a second of files of curves
    alone.

    Raises RecipeError for a control that cannot be measured, a file given twice, and a clip of
    another skeleton; MotionFileError for a file that cannot be read.
    """
    typed = [control.name for control in reopened.card.controls if control.measure is None]
    needed = [*typed, *_open_sets(reopened, labels), *_landmark_columns(reopened)]
    if needed:
        raise RecipeError(
            paths[0],
            f"nothing says {', '.join(map(repr, needed))}, which cannot be measured, expected a "
            "table with a column for each",
        )
    rows = [_row(reopened, path, labels) for path in paths]
    clip_table.refuse_repeats(rows)
    return _examples(reopened, rows, NewFiles(source, rate), [{} for _ in rows])


def examples_of_table(
    reopened: ReconstructedModel,
    path: Path,
    source: Source,
    labels: Labels,
    rate: float | None = None,
) -> tuple[list[Example], list[str]]:
    """Return examples of a table's rows, and notes on assumptions.

    Columns: `file`, relative to the table; optionally `first_frame` and `last_frame`; landmarks;
    controls by name, optional for those that can be measured; label sets by name, if `labels` does
    not give the name of all clips; `curves`, the file of a clip's curves, for a model with curves
    and a skeleton. Raises RecipeError, naming line and column, for an invalid cell, and as
    `examples_of_files`.
    """
    table = clip_table.open_table(path)
    landmarks, controls = _landmark_columns(reopened), reopened.card.controls
    typed = [control.name for control in controls if control.measure is None]
    sets = _open_sets(reopened, labels)
    curves = [COLUMN] * have_files(reopened.card)
    table.require(
        {
            "file": "the motion file",
            **dict.fromkeys(landmarks, "a landmark"),
            **dict.fromkeys(typed, "a control that cannot be measured"),
            **dict.fromkeys(sets, "a label set"),
            **dict.fromkeys(curves, "the file of the clip's curves"),
        }
    )
    columns = (*landmarks, *(control.name for control in controls), *sets, *curves)
    table.expect_only({"file", "first_frame", "last_frame", *columns})
    rows, controls_by_row = [], []
    for line, record in table.records:
        row_labels = {
            **labels,
            **{name: _label(reopened, table, line, record, name) for name in sets},
        }
        row = _table_row(table, line, record, row_labels, tuple(landmarks))
        curve_files = [_place(table, line, record, column) for column in curves]
        rows.append(replace(row, curve_place=curve_files[0]) if curve_files else row)
        names = [control.name for control in controls if control.name in record]
        controls_by_row.append({name: table.number(line, record, name) for name in names})
    clip_table.refuse_repeats(rows)
    return _examples(reopened, rows, NewFiles(source, rate), controls_by_row)


def _open_sets(reopened: ReconstructedModel, labels: Mapping[str, str]) -> list[str]:
    """Return the label sets of a model that labels do not name."""
    return [label_set.name for label_set in reopened.card.labels if label_set.name not in labels]


def _label(
    reopened: ReconstructedModel, table: ClipTable, line: int, record: dict[str, str], name: str
) -> str:
    """Return the name of a row in a label set; RecipeError for one that the model lacks."""
    names = next(one.names for one in reopened.card.labels if one.name == name)
    if record[name] not in names:
        suggestion = f"{record[name]!r}{did_you_mean(record[name], names)}"
        expected = f"expected one of {', '.join(names)}"
        raise RecipeError(table.name, f"column {name!r}: {suggestion}, {expected}", line)
    return record[name]


def _row(reopened: ReconstructedModel, path: Path, labels: Mapping[str, str]) -> ClipRow:
    performer, other_labels = _split(labels)
    curve_file = place_beside(reopened.card, path)
    row = ClipRow(
        path, str(path), None, performer, 0, None, np.zeros(0), (), other_labels=other_labels
    )
    return replace(row, curve_place=curve_file)


def _split(labels: Labels) -> tuple[str, dict[str, str]]:
    """Return the performer and the names in further label sets."""
    other_labels = {name: label for name, label in labels.items() if name != PERFORMER}
    return labels[PERFORMER], other_labels


def _table_row(
    table: ClipTable,
    line: int,
    record: dict[str, str],
    labels: Mapping[str, str],
    landmarks: tuple[str, ...],
) -> ClipRow:
    first = table.frame(line, record, "first_frame") if "first_frame" in record else 0
    last = table.frame(line, record, "last_frame") if "last_frame" in record else None
    if last is not None and last <= first:
        raise RecipeError(table.name, f"frames {first} to {last}, expected at least two", line)
    location = _place(table, line, record, "file")
    marks = tuple(table.frame(line, record, column) for column in landmarks)
    performer, other_labels = _split(labels)
    return ClipRow(
        location,
        table.name,
        line,
        performer,
        first,
        last,
        np.zeros(0),
        marks,
        other_labels=other_labels,
    )


def _place(table: ClipTable, line: int, record: dict[str, str], column: str) -> FileLocation:
    """Return the file that a cell names, relative to its table."""
    try:
        return data_folder.find(Path(table.name).parent, record[column])
    except RecipeError as fault:
        raise RecipeError(table.name, f"column {column!r}: {fault.message}", line) from fault


def _examples(
    reopened: ReconstructedModel,
    rows: Sequence[ClipRow],
    conventions: NewFiles,
    controls_by_row: Sequence[Mapping[str, float]],
) -> tuple[list[Example], list[str]]:
    alone = are_alone(reopened.card)
    files = {} if alone else ingest.read_files(rows, conventions.source)
    examples, notes, stretches = [], list[str](), []
    for row, values in zip(rows, controls_by_row, strict=True):
        clip, left_out = whole_clip(reopened.card, row, files, conventions)
        example, row_notes, stretch = _example(reopened, row, clip)
        controls = _controls(reopened, example, values)
        examples.append(replace(example, controls=controls))
        notes += [note for note in (*left_out, *row_notes) if note not in notes]
        stretches.append(stretch)
    if conventions.source.root_offset is None:
        notes += ingest.offset_notes(files)
    notes += ingest.reader_notes(files)
    return examples, notes + ingest.stretch_notes(rows, stretches)


def _example(
    reopened: ReconstructedModel, row: ClipRow, uncut: Clip
) -> tuple[Example, list[str], float]:
    """Return the example of a row, notes on it, and the stretch of its bones, m.

    uncut: all frames of its file.
    """
    card = reopened.card
    cut, last = ingest.cut_frames(uncut, row)
    clip, notes = _reduce_to_skeleton(_without_dummies(cut, card.skeleton), card.skeleton, row)
    facing_angle = reopened.card.making.facing
    clip = facing.turn_basis(clip, facing_angle or 0.0)
    clip, jumps, stretch = canonical.canonicalize(
        clip, card.cyclic, card.root == "in_place", facing_angle is not None
    )
    marks = (
        *measured_controls.landmarks(row, last, _landmark_columns(reopened)),
        *_found_landmarks(reopened, row, clip),
    )
    nothing = np.full(len(card.controls), np.nan)
    return Example(row, clip, nothing, marks, jumps, facing=facing_angle), notes, stretch


def _without_dummies(clip: Clip, family: Skeleton) -> Clip:
    """Return the clip without the dummy roots that the family's files had above its root."""
    figure = clip.skeleton
    above = figure.names.index(family.names[0]) if family.names[0] in figure.names else 0
    chain = list(range(-1, above))
    is_chain = list(figure.parents[: above + 1]) == chain
    alone = all(figure.parents.count(joint) == 1 for joint in range(above))
    return skeleton_checks.collapse_roots(clip, above) if is_chain and alone else clip


def _reduce_to_skeleton(clip: Clip, family: Skeleton, row: ClipRow) -> tuple[Clip, list[str]]:
    """Return the clip of the family's joints alone, and a note on its other joints.

    Raises RecipeError if joints are missing or have other parents.
    """
    clip = clip_joints.with_end_joints(clip, family.names)
    figure = clip.skeleton
    missing = [name for name in family.names if name not in figure.names]
    if missing:
        raise row.error(
            f"{row.file} has no joints {missing}, which the model has: expected a clip of the "
            "same skeleton"
        )
    smaller = clip_joints.ordered_as(clip, family.names)
    if smaller is None or not smaller.skeleton.same_tree(family):
        raise row.error(
            f"{row.file} has the model's joints with other parents: expected a clip of the same "
            "skeleton"
        )
    surplus = [name for name in figure.names if name not in family.names]
    note = f"{row.file}: joints {surplus}, which the model does not have, were left out"
    return smaller, [note] if surplus else []


def remeasure(
    reopened: ReconstructedModel, before: Sequence[Example], after: Sequence[Example]
) -> list[Example]:
    """Return shifted examples with their measured controls measured again.

    The travel of a cycle on an arc depends on the phase at which it begins.
    """
    examples = []
    for old, new in zip(before, after, strict=True):
        controls = zip(
            reopened.card.controls, old.controls, _controls(reopened, old, {}), strict=True
        )
        stated = {
            control.name: float(value) for control, value, measured in controls if value != measured
        }
        examples.append(replace(new, controls=_controls(reopened, new, stated)))
    return examples


def _controls(
    reopened: ReconstructedModel, example: Example, stated: Mapping[str, float]
) -> Floats:
    """Return the controls (d,) of an example: given, measured, or else unchanged."""
    quantities = measured_controls.measured_quantities(example.clip)

    def value(control: Control, default: float) -> float:
        if control.name in stated:
            return stated[control.name]
        if control.measure is None:
            return default
        at = _landmark(reopened, control, example) * (len(example.clip) - 1)
        measured = measures.evaluate(control.measure, replace(quantities, landmark=at))
        return round(measured, measured_controls.DECIMALS) + 0.0

    pairs = zip(reopened.card.controls, example.controls.tolist(), strict=True)
    return np.array([value(control, default) for control, default in pairs])


def _landmark_columns(reopened: ReconstructedModel) -> list[str]:
    """Return the columns of the landmarks, in their order in time."""
    times = reopened.card.making.landmarks
    return sorted((name for name in times if name not in TIME_NAMES), key=lambda name: times[name])


def _found_names(reopened: ReconstructedModel) -> list[str]:
    """Return the moments of the event that are found in each clip: one or none."""
    return [name for name in reopened.card.making.landmarks if name in TIME_NAMES]


def _found_landmarks(reopened: ReconstructedModel, row: ClipRow, clip: Clip) -> list[float]:
    """Return the shares of a clip at which the model's event is, as in training."""
    event = reopened.card.event
    if event is None:
        return []
    landmarks = []
    for at in _found_names(reopened):
        share = measured_controls.moment_share(clip, event.joint, at)
        name = clip.skeleton.names[event.joint]
        landmarks.append(measured_controls.event_landmark(row, name, at, share))
    return landmarks


def _landmark(reopened: ReconstructedModel, control: Control, example: Example) -> float:
    """Return the share of the clip at which a control is measured; 0 without landmark."""
    if control.measure is None or control.measure.share is None:
        return 0.0
    names = [*_landmark_columns(reopened), *_found_names(reopened)]
    times = np.array([reopened.card.making.landmarks[name] for name in names])
    return example.landmarks[int(np.argmin(np.abs(times - control.measure.share)))]


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
    path = motion.with_suffix(SUFFIX)
    if not path.is_file():
        raise RecipeError(
            str(motion),
            f"found no {path.name} beside it, expected the file of its curves, which the model "
            f"has; or a table with a column {COLUMN!r}",
        )
    return path


def whole_clip(
    card: ModelCard, row: ClipRow, files: Mapping[str, MotionFile], conventions: NewFiles
) -> tuple[Clip, list[str]]:
    """Return the clip of all frames of a row with the model's curves, and notes.

    files: motion files by place. Raises RecipeError for curves that do not fit the model or the
    motion, and without a rate where files have none.
    """
    if not card.curves:
        return ingest.clip_of_file(files[row.motion], conventions.source), []
    values, surplus = curve_files.read_known(row.curve_file, card.curves)
    note = f"{row.curve_file}: curves {surplus}, which the model does not have, were left out"
    notes = [note] if surplus else []
    if not are_alone(card):
        clip = ingest.clip_of_file(files[row.motion], conventions.source)
        return curve_files.with_curves(clip, values, row), notes
    if conventions.rate is None:
        raise row.error("nothing says the frames a second of its curves, expected --rate")
    return curve_files.resting_clip(values, conventions.rate), notes
