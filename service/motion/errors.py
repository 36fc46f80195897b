"""Every error that this project raises on purpose.

MotionError
├── FileError            a file that cannot be used, with its path and, where known, its line
│   ├── BvhError         a motion file that breaks the BVH grammar or contradicts itself
│   ├── RecipeError      a recipe or its table of clips
│   ├── ModelError       an .onnx file that is corrupt, foreign or of an unknown format
│   └── UsdError         a USD file that does not open
├── QueryError           a question that has no answer; names the field
│   ├── UnknownModel
│   ├── UnknownFormat
│   ├── InvalidField     missing, unknown, of a wrong type, or outside the allowed range
│   ├── OutsideSamples   controls outside what was sampled, when the client asked to refuse them
│   └── OutOfReach       a target that no captured motion comes near, when the same was asked
├── ClusterError         a Dask cluster that cannot be reached or worked on
├── WorkerDied           a process that did a part of the work has gone
└── TrainingError        samples from which no model can be made
    └── ExportRefused    the graph does not answer what the reference answers

A message says what was found and what was expected. None of them knows of HTTP:
service/web/problems.py maps each class to a status.
"""

from pathlib import Path


class MotionError(Exception):
    """Base of every error that names a fault in what was given."""


class FileError(MotionError):
    """A file that cannot be used; `path` and `line` say where the fault is."""

    def __init__(self, path: str | Path, message: str, line: int | None = None) -> None:
        where = f"{path}:{line}" if line is not None else f"{path}"
        super().__init__(f"{where}: {message}")
        self.path = str(path)
        self.line = line
        self.message = message

    def __reduce__(self) -> tuple[type["FileError"], tuple[str, str, int | None]]:
        # What is raised in one process is told in another.
        return type(self), (self.path, self.message, self.line)


class BvhError(FileError):
    """A motion file that breaks the BVH grammar or contradicts itself."""


class RecipeError(FileError):
    """A recipe, or a row and column of its table of clips, that cannot be followed."""


class ModelError(FileError):
    """An .onnx file that is corrupt, foreign or of an unknown format."""


class UsdError(FileError):
    """A USD file that does not open."""


class QueryError(MotionError):
    """A question that has no answer; `field` is the path of what is wrong with it, and `index` its
    place where the field holds many."""

    def __init__(self, field: str, message: str, index: int | None = None) -> None:
        where = field if index is None else f"{field}/{index}"
        super().__init__(f"{where}: {message}")
        self.field = field
        self.message = message
        self.index = index

    def __reduce__(self) -> tuple[type["QueryError"], tuple[str, str, int | None]]:
        return type(self), (self.field, self.message, self.index)


class UnknownModel(QueryError):
    """No model of that name is loaded."""


class UnknownFormat(QueryError):
    """No encoder writes that format."""


class InvalidField(QueryError):
    """A field is missing, unknown, of a wrong type, or outside the allowed range."""


class OutsideSamples(QueryError):
    """Controls outside what was sampled, when the client asked for them to be refused."""


class OutOfReach(QueryError):
    """A target that the motion cannot meet, when the client asked for that to be refused."""


class ClusterError(MotionError):
    """A Dask cluster that cannot be reached, or whose workers cannot do the work; names it."""

    def __init__(self, address: str, message: str) -> None:
        super().__init__(f"{address}: {message}")
        self.address = address
        self.message = message

    def __reduce__(self) -> tuple[type["ClusterError"], tuple[str, str]]:
        return type(self), (self.address, self.message)


class WorkerDied(MotionError):
    """A process that did a part of the work has gone: killed, or out of memory."""


class TrainingError(MotionError):
    """Samples from which no model can be made."""


class ExportRefused(TrainingError):
    """The exported graph does not answer what the float64 reference answers."""
