"""Rows of an export: clips that a table, a grid or a sampling asks for.

A row is the question that its cells ask over HTTP: text is decoded as the parameters of a URL, and
values of JSON and Parquet as a body. It leaves open the controls without a value; other fields
without one have the defaults of the command. A table is CSV, JSON Lines or Parquet, by its ending,
and is read anew at each pass, a few rows at a time.

    source = open_source(model, "usdc", path=path)
    for row in source.rows(): ...

Equal seeds of a sampling give equal points on every machine: only sums, products, sorts and NumPy's
guaranteed random streams are used.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, product
from math import prod
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
import orjson
from msgspec import structs, to_builtins
from numpy.typing import NDArray

from posefield.batch import tables
from posefield.batch.tables import TABLES, Column, Columns, RawRow, RawRows, shortened_text
from posefield.common.errors import InvalidField, QueryError, UnknownFormat, did_you_mean
from posefield.common.units import Floats
from posefield.encode.formats import ALL_ENCODERS, CLIP_ENCODERS
from posefield.model_file.model_card import ModelCard
from posefield.question import json_decoding, text_decoding
from posefield.question.motion_question import LEGAL_NAME, ClipQuestion
from posefield.robots.robot import Robot
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

Question = TypeVar("Question", covariant=True)

MAX_POINTS = 10**9
"""Points of the largest grid or sampling; a greater number is considered a typing error."""
MAX_STEPS = 10**6
"""Values of one axis of a grid, which are held in memory."""
METHOD, SEED = "latin", 0
DEFAULTS = ClipQuestion(controls={})
REPEATED_NAME = "expected a name of its own: an earlier row has it, capitals count for nothing"
TEXT_FIELDS = ("exact", "floor", "targets", "labels")
"""Fields that JSON and Parquet may have as text, too."""


@dataclass(frozen=True)
class Row(Generic[Question]):
    """A question of many, which gives a file.

    name: of the file, without extension. format: its extension; empty where all rows have that of a
    batch. place: origin of the question, such as "queries.csv:7".
    """

    name: str
    format: str
    question: Question
    place: str


@dataclass(frozen=True)
class RowFault:
    """An invalid row: its origin in the source, and the reason."""

    place: str
    message: str


CheckedRow = Row[ClipQuestion] | RowFault


@dataclass(frozen=True)
class RowReader:
    """Rows of a source for one model: the same rows in the same order at each pass.

    raw: begins a pass. text: whether cells are text. has_names: whether rows may give names;
    generated ones are unique. format, question: defaults of missing values; the controls are not
    used. digest: SHA-256 of all parameters and data that determine the rows, except the model.
    """

    raw: RawRows
    text: bool
    has_names: bool
    model: Synthesizer
    format: str
    question: ClipQuestion
    digest: str

    def rows(self) -> Iterator[CheckedRow]:
        """Yield a row, or the fault of one that is no question or has the name of another.

        Raises FileError if the rest cannot be read or has changed.
        """
        names: set[str] = set()
        for index, (location, cells) in enumerate(self.raw()):
            try:
                if isinstance(cells, QueryError):
                    raise cells
                row = self._decode(location, index, cells)
                if self.has_names and row.name.lower() in names:
                    raise InvalidField("name", f"{row.name!r}, {REPEATED_NAME}")
            except QueryError as error:
                yield RowFault(location, str(error))
                continue
            if self.has_names:
                names.add(row.name.lower())
            yield row

    def check(self, row: Row[ClipQuestion]) -> None:
        """Raise the QueryError of a row without an answer, as far as it is known at once."""
        clips.check(self.model, row.question)

    def _decode(
        self, location: str, index: int, cells: Iterable[tuple[Column, Any]]
    ) -> Row[ClipQuestion]:
        name, extension = generated_name(index), self.format
        texts: list[tuple[str, str]] = []
        text_fields: set[str] = set()
        values: dict[str, Any] = {}
        for column, cell in cells:
            if column.field == "format":
                extension = _checked_format(cell, self.model.session.card.robot)
            elif column.field == "name":
                name = _checked_name(cell)
            elif isinstance(cell, str) and (self.text or column.field in TEXT_FIELDS):
                texts += column.texts(cell)
                text_fields.add(column.field)
            else:
                (values.setdefault(column.group, {}) if column.group else values)[column.name] = (
                    cell
                )
        question = self.question
        if texts:
            decoded = text_decoding.decode_question(ClipQuestion, texts)
            question = _merged(question, decoded, text_fields)
        if values:
            decoded = json_decoding.convert_question(ClipQuestion, {"controls": {}} | values)
            question = _merged(question, decoded, values)
        return Row(name, extension, question, location)


def _merged(defaults: ClipQuestion, row: ClipQuestion, fields: Iterable[str]) -> ClipQuestion:
    """Return a question with the fields of a row that have a value; other labels remain."""
    values = {name: getattr(row, name) for name in fields}
    if "labels" in values:
        values["labels"] = {**defaults.labels, **row.labels}
    return structs.replace(defaults, **values)


def _checked_format(cell: object, robot: Robot | None) -> str:
    """Return the extension of a format of a model's clips; robot: of the model, or None.

    Raises UnknownFormat for any other value, and InvalidField as `ClipEncoder.check` does.
    """
    if isinstance(cell, str) and cell in ALL_ENCODERS:
        ALL_ENCODERS[cell].check(robot)
        return cell
    formats = CLIP_ENCODERS if robot is None else ALL_ENCODERS
    hint = did_you_mean(cell, formats) if isinstance(cell, str) else ""
    expected = f"expected one of {', '.join(formats)}"
    raise UnknownFormat("format", f"{shortened_text(cell)}{hint}, {expected}")


def _checked_name(cell: object) -> str:
    """Return a name that is a legal file name on all systems; InvalidField for any other value."""
    if isinstance(cell, str) and LEGAL_NAME.fullmatch(cell):
        return cell
    expected = "1 to 100 of the letters A to Z, digits, '.', '_' and '-', not '.' first"
    raise InvalidField("name", f"{shortened_text(cell)}, expected {expected}")


def generated_name(index: int) -> str:
    """Return the name of the row with this index, from 0; it does not depend on skipped rows."""
    return f"clip-{index:06d}"


def repeated_names(names: Iterable[str]) -> Iterator[int]:
    """Yield the indices of names that an earlier one equals but for capitals."""
    earlier: set[str] = set()
    for index, name in enumerate(names):
        if name.lower() in earlier:
            yield index
        earlier.add(name.lower())


def open_source(
    model: Synthesizer,
    format: str,  # noqa: A002  # as the command's option
    question: ClipQuestion = DEFAULTS,
    *,
    path: Path | None = None,
    grid: Sequence[str] = (),
    sample: int | None = None,
    method: str | None = None,
    seed: int | None = None,
) -> RowReader:
    """Return the rows of a file, a grid or a sampling, exactly one of which is given.

    format, question: defaults of missing values. grid: NAME=VALUES texts. sample: number of points.
    method, seed: of a sampling only. Raises InvalidField, UnknownFormat and OutsideSamples for
    invalid options, and FileError for a file that cannot be read or has a heading that does not fit
    the model.
    """
    options = {"a file": path, "--grid": grid or None, "--sample": sample}
    sources = [name for name, option in options.items() if option is not None]
    if len(sources) != 1:
        sources_given = " and ".join(sources) or "none"
        raise InvalidField("queries", f"{sources_given}, expected one of {', '.join(options)}")
    for name, option in (("method", method), ("seed", seed)):
        if option is not None and sample is None:
            raise InvalidField(name, "without --sample, expected with it")
    card = model.session.card
    _checked_format(format, card.robot)
    middle = {control.name: control.default for control in card.controls}
    clips.check(model, structs.replace(question, controls=middle))
    columns = tables.table_columns(card)
    spec: dict[str, Any]
    raw: RawRows
    if path:
        extension = path.suffix.lower()
        if extension not in TABLES:
            raise UnknownFormat("queries", f"{path.name!r} ends in none of {', '.join(TABLES)}")
        table = tables.open_table(path, columns)
        raw, text, has_names = table.rows, extension == ".csv", True
        spec = {"file": extension, "sha256": table.digest}
    elif grid:
        axes = parse_grid(grid, columns)
        raw, text, has_names = partial(_grid_rows, axes), True, False
        spec = {"grid": [[column.field, column.name, texts] for column, texts in axes]}
    else:
        method, seed, count = method or METHOD, SEED if seed is None else seed, sample or 0
        check_sampling(method, count, seed)
        sampled = tuple(columns[f"controls/{control.name}"] for control in card.controls)
        raw = partial(_sampled_rows, sampled, partial(METHODS[method], card, count, seed))
        text, has_names, spec = False, False, {"method": method, "count": count, "seed": seed}
    spec |= {"format": format, "usual": to_builtins(question)}
    content = orjson.dumps(spec, option=orjson.OPT_SORT_KEYS)
    digest = hashlib.sha256(content).hexdigest()
    return RowReader(raw, text, has_names, model, format, question, digest)


def points(path: Path, model: Synthesizer) -> list[dict[str, float]]:
    """Return the controls of each row of a file, those that it leaves open as in its clip.

    Raises as `open_source` does, and InvalidField for an invalid row.
    """
    controls = []
    for row in open_source(model, "usdc", path=path).rows():
        if isinstance(row, RowFault):
            raise InvalidField("candidates", f"{row.place}: {row.message}")
        try:
            clips.check(model, row.question)
        except QueryError as error:
            raise InvalidField("candidates", f"{row.place}: {error}") from error
        controls.append(model.question(row.question).controls)
    return controls


def parse_grid(texts: Sequence[str], columns: Columns) -> list[tuple[Column, list[str]]]:
    """Return the columns of NAME=VALUES texts, and their values as text.

    VALUES: one value, several separated by commas, or `start:stop:count`, both ends included.
    Raises InvalidField for a malformed or repeated one.
    """
    axes = []
    for text in texts:
        name, _, values = text.partition("=")
        if not values:
            expected = "expected NAME=VALUE,VALUE or NAME=START:STOP:COUNT"
            raise InvalidField("grid", f"{text!r}, {expected}")
        try:
            column = tables.find_column(columns, name.strip())
            if column.field == "name":
                raise ValueError(f"column {name!r}, expected one that clips may share")
            if column.field == "targets":
                raise ValueError(f"column {name!r}, expected one whose values have no commas")
            steps = column.numeric and ":" in values
            axes.append((column, _grid_steps(values) if steps else values.split(",")))
            if "" in axes[-1][1]:
                raise ValueError("an empty value, expected one between commas")
        except ValueError as fault:
            raise InvalidField("grid", f"{text!r}: {fault}") from fault
    columns_used = [column for column, _ in axes]
    for index, column in enumerate(columns_used):
        if column in columns_used[:index]:
            raise InvalidField("grid", f"{column.name!r} twice, expected once")
    count = prod(len(values) for _, values in axes)
    if count > MAX_POINTS:
        raise InvalidField("grid", f"{count} points, expected at most {MAX_POINTS}")
    return axes


def _grid_steps(text: str) -> list[str]:
    """Return the evenly spaced numbers of start:stop:count; ValueError for malformed text."""
    try:
        start, stop, steps = map(text_decoding.parse_number, text.split(":"))
    except ValueError as fault:
        raise ValueError(f"{text!r}, expected START:STOP:COUNT, numbers as 0.5") from fault
    if not steps.is_integer() or not 2 <= steps <= MAX_STEPS:
        raise ValueError(f"{text!r}, expected START:STOP:COUNT with a COUNT of 2 to {MAX_STEPS}")
    return [repr(value) for value in np.linspace(start, stop, int(steps)).tolist()]


def _grid_rows(axes: Sequence[tuple[Column, Sequence[str]]]) -> Iterator[RawRow]:
    """Yield all combinations of the axes' values; the last axis varies fastest."""
    columns = [column for column, _ in axes]
    for number, texts in enumerate(product(*(values for _, values in axes)), start=1):
        yield f"grid point {number}", zip(columns, texts, strict=True)


def _sampled_rows(
    columns: Sequence[Column], draw: Callable[[], Iterator[Floats]]
) -> Iterator[RawRow]:
    """Yield the points of a sampling, drawn in blocks (n, d)."""
    for number, point in enumerate(chain.from_iterable(map(np.ndarray.tolist, draw())), start=1):
        yield f"sample {number}", zip(columns, point, strict=True)


BLOCK_SIZE = 4096
"""Points of a block; larger blocks are no faster."""
ROUNDS = 8
"""Rounds of the Feistel network. Four suffice for large numbers (Luby and Rackoff 1988)."""

Integers = NDArray[np.uint64]


def check_sampling(method: str, count: int, seed: int) -> None:
    """Raise InvalidField for an unknown method, a count out of range or a negative seed."""
    if method not in METHODS:
        hint = did_you_mean(method, METHODS)
        raise InvalidField("method", f"{method!r}{hint}, expected one of {', '.join(METHODS)}")
    if not 1 <= count <= MAX_POINTS:
        raise InvalidField("sample", f"{count}, expected 1 to {MAX_POINTS}")
    if seed < 0:
        raise InvalidField("seed", f"{seed}, expected 0 or more")


def latin_hypercube(card: ModelCard, count: int, seed: int) -> Iterator[Floats]:
    """Yield a Latin hypercube over the sampled ranges, in blocks (n, d).

    Each of `count` equal parts of each control's range contains one point (McKay et al. 1979). A
    discrete control takes its sampled values in equal shares.
    """
    generators = [np.random.default_rng((seed, axis)) for axis in range(len(card.controls))]
    for first, size in _blocks(count):
        points = np.empty((size, len(card.controls)))
        for axis, control in enumerate(card.controls):
            rows = np.arange(first, first + size, dtype=np.uint64)
            intervals = permute(rows, count, (seed, axis, 1))
            jitter = generators[axis].random(size)
            if control.values:
                chosen = intervals.astype(np.int64) * len(control.values) // count
                points[:, axis] = np.array(control.values)[chosen]
            else:
                share = (intervals + jitter) / count
                points[:, axis] = control.minimum + share * (control.maximum - control.minimum)
        yield points


def permute(indices: Integers, count: int, seed: tuple[int, ...]) -> Integers:
    """Return the images (n,) of indices (n,) under a random permutation of 0 to count - 1.

    Each seed has its own permutation, computed index by index. A Feistel network permutes the
    numbers of an even number of bits; images beyond `count` are permuted again until they are below
    it (Black and Rogaway 2002), fewer than four times on average.
    """
    keys: Integers = np.array(np.random.SeedSequence(seed).generate_state(ROUNDS, np.uint64))
    half = np.uint64(max(1, ((count - 1).bit_length() + 1) // 2))
    images = _feistel_network(indices.astype(np.uint64), keys, half)
    beyond = np.flatnonzero(images >= count)
    while len(beyond):
        images[beyond] = _feistel_network(images[beyond], keys, half)
        beyond = beyond[images[beyond] >= count]
    return images


def _feistel_network(numbers: Integers, keys: Integers, half: np.uint64) -> Integers:
    mask = (np.uint64(1) << half) - np.uint64(1)
    left, right = numbers >> half, numbers & mask
    for key in keys:
        left, right = right, left ^ (_scramble(right + key) & mask)
    return (left << half) | right


def _scramble(numbers: Integers) -> Integers:
    """Return numbers scrambled by the finaliser of SplitMix64 (Steele et al. 2014)."""
    numbers = (numbers ^ (numbers >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    numbers = (numbers ^ (numbers >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return numbers ^ (numbers >> np.uint64(31))


def hull_points(card: ModelCard, count: int, seed: int) -> Iterator[Floats]:
    """Yield points in the convex hull of the captured clips' controls, in blocks (n, d).

    Each point is uniform in the simplex of d + 1 random clips, so points are denser where clips
    are. Discrete controls are mixed like continuous ones.
    """
    examples = np.array(card.examples)
    corners = examples.shape[1] + 1
    rng = np.random.default_rng(seed)
    for _, size in _blocks(count):
        numbers = rng.random((size, 2 * corners - 1))
        clips = (numbers[:, :corners] * len(examples)).astype(np.int64)
        # Gaps between sorted uniform numbers are uniform in the simplex (Devroye 1986, V.2).
        cuts = np.sort(numbers[:, corners:], axis=1)
        weights = np.diff(cuts, axis=1, prepend=0.0, append=1.0)
        # A sum in a fixed order, unlike a matrix product's.
        yield sum(weights[:, k, None] * examples[clips[:, k]] for k in range(corners))


METHODS: dict[str, Callable[[ModelCard, int, int], Iterator[Floats]]] = {
    "latin": latin_hypercube,
    "hull": hull_points,
}


def _blocks(count: int) -> Iterator[tuple[int, int]]:
    """Yield first row and size of each block."""
    for first in range(0, count, BLOCK_SIZE):
        yield first, min(BLOCK_SIZE, count - first)
