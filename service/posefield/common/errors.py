"""Errors that this project raises.

MotionError
├── FileError            a file that cannot be used, with its path and, where known, its line
│   ├── MotionFileError  a motion file that cannot be read or contradicts its recipe
│   │   ├── BvhError     a motion file that breaks the BVH grammar or contradicts itself
│   │   └── AcclaimError a skeleton (ASF) or motion (AMC) file that breaks its grammar
│   ├── RecipeError      a recipe or its table of clips
│   ├── ModelError       an .onnx file that is corrupt, foreign or of an unknown format
│   └── UsdError         a USD file that does not open
├── QueryError           a query that has no answer; names the field
│   ├── FormError        text or JSON that is not a valid query
│   ├── UnknownModel
│   ├── UnknownFormat
│   ├── InvalidField     missing, unknown, of a wrong type, or outside the allowed range
│   ├── OutsideSamples   controls outside the sampled ranges, if the client chose to refuse them
│   └── OutOfReach       a target that the motion cannot meet, if the client chose to refuse it
├── ClusterError         a Dask cluster that cannot be reached or used
├── WorkerDied           a worker process that ended before its work was done
└── TrainingError        samples from which a model cannot be trained
    └── ExportRefused    the graph's results differ from those of the reference

A message states the found and the expected value. The errors are independent of HTTP:
service/posefield/http/api/problems.py maps each class to a status.
"""

from collections.abc import Iterable
from itertools import islice
from pathlib import Path


class MotionError(Exception):
    """Base of all errors that are caused by invalid input or a failed resource."""


class FileError(MotionError):
    """A file that cannot be used; `path` and `line` (from 1) locate the error."""

    def __init__(self, path: str | Path, message: str, line: int | None = None) -> None:
        super().__init__(f"{path}: {message}" if line is None else f"{path}:{line}: {message}")
        self.path = str(path)
        self.line = line
        self.message = message

    def __reduce__(self) -> tuple[type["FileError"], tuple[str, str, int | None]]:
        # Errors of worker processes are pickled with their fields.
        return type(self), (self.path, self.message, self.line)


class MotionFileError(FileError):
    """A motion file that cannot be read, or whose unit, axes or rate contradict the recipe."""


class BvhError(MotionFileError):
    """A motion file that breaks the BVH grammar or contradicts itself."""


class AcclaimError(MotionFileError):
    """A skeleton (ASF) or motion (AMC) file that breaks its grammar or contradicts itself."""


class RecipeError(FileError):
    """A recipe, or a row and column of its table of clips, that cannot be followed."""


class ModelError(FileError):
    """An .onnx file that is corrupt, foreign or of an unknown format."""


class UsdError(FileError):
    """A USD file that does not open."""


class QueryError(MotionError):
    """A query that has no answer; `field` is the path of the parameter at fault.

    index: position in a parameter with many values.
    """

    def __init__(self, field: str, message: str, index: int | None = None) -> None:
        where = field if index is None else f"{field}/{index}"
        super().__init__(f"{where}: {message}" if where else message)
        self.field = field
        self.message = message
        self.index = index

    def __reduce__(self) -> tuple[type["QueryError"], tuple[str, str, int | None]]:
        return type(self), (self.field, self.message, self.index)


class FormError(QueryError):
    """Text or JSON that is not a valid query; field: a JSON pointer without its first slash.

    The field is "" for an error of the whole document.
    """


class UnknownModel(QueryError):
    """No model of that name is loaded."""


class UnknownFormat(QueryError):
    """No encoder writes that format."""


class InvalidField(QueryError):
    """A field is missing, unknown, of a wrong type, or outside the allowed range."""


class OutsideSamples(QueryError):
    """Controls outside the sampled ranges, for a client that requested an error in this case."""


class OutOfReach(QueryError):
    """A target that the motion cannot meet, for a client that requested an error in this case."""


class ClusterError(MotionError):
    """A Dask cluster that cannot be reached, or whose workers cannot do the work.

    address: of its scheduler.
    """

    def __init__(self, address: str, message: str) -> None:
        super().__init__(f"{address}: {message}")
        self.address = address
        self.message = message

    def __reduce__(self) -> tuple[type["ClusterError"], tuple[str, str]]:
        return type(self), (self.address, self.message)


class WorkerDied(MotionError):
    """A worker process that ended before its work was done: killed, or out of memory."""


class TrainingError(MotionError):
    """Samples from which a model cannot be trained."""


class ExportRefused(TrainingError):
    """The exported graph's results differ from those of the float64 reference."""


# An unknown name may be a client's text: its length and the number of compared names are bounded.
MAX_NAME_LENGTH = 40
"""Longer names get no suggestion, since a comparison takes quadratic time."""
MAX_NAMES = 1000
"""Number of known names that are compared, as many as a motion file can have joints."""
MIN_PREFIX = 3
"""Length from which the beginning of a name suggests it."""
SIMILARITY = 0.7
"""Smallest similarity of a suggestion: share of equal characters, as `difflib` defines it."""


def similar_name(name: str, names: Iterable[str]) -> str | None:
    """Return the known name that is most similar to `name`, or None if none is similar enough.

    None also if two are equally similar. Case and the separators "_", "-", ":" and " " do not
    count.
    """
    if len(name) > MAX_NAME_LENGTH:
        return None
    short = (
        candidate for candidate in islice(names, MAX_NAMES) if len(candidate) <= MAX_NAME_LENGTH
    )
    by_plain_name = {_plain(candidate): candidate for candidate in short}
    # Imported here, because only refused questions need it.
    from difflib import SequenceMatcher, get_close_matches

    plain_name = _plain(name)
    longer = [
        candidate
        for candidate in by_plain_name
        if len(plain_name) >= MIN_PREFIX and candidate.startswith(plain_name)
    ]
    if len(longer) == 1:
        return by_plain_name[longer[0]]
    matches = get_close_matches(plain_name, by_plain_name, n=2, cutoff=SIMILARITY)
    tied = len(
        {SequenceMatcher(None, candidate, plain_name).ratio() for candidate in matches}
    ) < len(matches)
    return by_plain_name[matches[0]] if matches and not tied else None


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Return the text " (did you mean 'NAME'?)" to follow an unknown name, or "" for no name."""
    similar = similar_name(name, names)
    return "" if similar is None else f" (did you mean {similar!r}?)"


_SEPARATORS = str.maketrans("", "", "_-: ")


def _plain(name: str) -> str:
    return name.casefold().translate(_SEPARATORS)
