"""NumPy arrays from binary responses; arrays are read-only views of the received bytes."""

from typing import Any, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt
from msgspec import Struct

from posefield_client.generated import PerformanceReport, Trust
from posefield_client.wire import Reply

T = TypeVar("T")
Array = npt.NDArray[Any]
KINDS = "fiub"


class Arrays(Struct, frozen=True, eq=False):
    """Answer with arrays, of which people are shown the shapes."""

    def __repr__(self) -> str:
        said = (f"{name}={_shape(getattr(self, name))}" for name in self.__struct_fields__)
        return f"{type(self).__name__}({', '.join(said)})"


def _shape(value: Any) -> str:
    """Return an array as its type and shape, a list of names as its length, and Trust in short."""
    if isinstance(value, np.ndarray):
        return f"<{value.dtype} {value.shape}>"
    if isinstance(value, Trust):
        return f"<{value.model}, sigma {value.sigma:.3g} m>"
    if isinstance(value, PerformanceReport):
        return f"<{len(value.segments)} segments, sigma {value.sigma:.3g} m>"
    return f"<{len(value)} items>" if isinstance(value, tuple) and len(value) > 3 else repr(value)


class Pose(Arrays, frozen=True, eq=False):
    """Poses at S times of the J joints that the model's card names.

    times: (S,), s. rotations: (S, J, 4), unit quaternions w x y z, local to the parent.
    root_position: (S, 3), m. bone_offsets: (J, 3), m. curves: (S, C), values of the curves that the
    card names; None for a model without curves.
    """

    trust: Trust
    times: Array
    rotations: Array
    root_position: Array
    bone_offsets: Array
    curves: Array | None = None


class ClipNumbers(Arrays, frozen=True, eq=False):
    """A clip of F frames of J joints, with arrays as in Pose.

    rate: frames per second. names, parents: of the joints; the root's parent is -1. units: of the
    arrays, by name. curve_names: of the C curves; empty for a model without curves.
    """

    trust: Trust
    units: dict[str, str]
    names: tuple[str, ...]
    parents: tuple[int, ...]
    rate: float
    times: Array
    rotations: Array
    root_position: Array
    bone_offsets: Array
    curve_names: tuple[str, ...] = ()
    curves: Array | None = None


class PerformanceNumbers(Arrays, frozen=True, eq=False):
    """A performance of F frames of J joints, with arrays as in ClipNumbers and its own report."""

    trust: PerformanceReport
    units: dict[str, str]
    names: tuple[str, ...]
    parents: tuple[int, ...]
    rate: float
    times: Array
    rotations: Array
    root_position: Array
    bone_offsets: Array


class SigmaGrid(Arrays, frozen=True, eq=False):
    """Sigma over two controls.

    across_values: (columns,). along_values: (rows,). controls: values of the other controls. sigma:
    (rows, columns), m. inside: (rows, columns), True within all sampled ranges. supported: (rows,
    columns), True near captured clips; None from services that do not report it.
    """

    model: str
    across: str
    along: str
    controls: dict[str, float]
    performer: str | None
    units: dict[str, str]
    across_values: Array
    along_values: Array
    sigma: Array
    inside: Array
    supported: Array | None = None


class CrowdPoses(Arrays, frozen=True, eq=False):
    """One pose each of N characters of J joints, in the order of the request.

    rotations: (N, J, 4), the root's in world space. root_position: (N, 3) in world space, m.
    bone_offsets: (N, J, 3), m. duration: (N,), s. sigma: (N,), m. levels: (N,). error_px: (N,);
    None without a camera. supported: (N,), True near captured clips; None from services that do not
    report it. curves: values (N, C) of the curves with names curve_names; None for a model without
    them.
    """

    model: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    units: dict[str, str]
    warnings: tuple[str, ...]
    rotations: Array
    root_position: Array
    bone_offsets: Array
    duration: Array
    sigma: Array
    levels: Array
    error_px: Array | None = None
    supported: Array | None = None
    curve_names: tuple[str, ...] = ()
    curves: Array | None = None


def _array(kind: type, found: Any) -> Array:
    """Return an array from its encoding: a map of `dtype`, `shape`, and little-endian `data`."""
    if not isinstance(found, dict) or not found.keys() >= {"dtype", "shape", "data"}:
        raise ValueError("expected a map of dtype, shape and data")
    dtype = np.dtype(found["dtype"])
    if dtype.kind not in KINDS:
        raise ValueError(f"an array of {found['dtype']}, expected numbers")
    return np.frombuffer(found["data"], dtype).reshape(found["shape"])


SHAPES: dict[Any, dict[str, str]] = {
    Pose: {
        "times": "S",
        "rotations": "SJ4",
        "root_position": "S3",
        "bone_offsets": "J3",
        "curves": "SC",
    },
    ClipNumbers: {
        "names": "J",
        "parents": "J",
        "times": "F",
        "rotations": "FJ4",
        "root_position": "F3",
        "bone_offsets": "J3",
        "curve_names": "C",
        "curves": "FC",
    },
    PerformanceNumbers: {
        "names": "J",
        "parents": "J",
        "times": "F",
        "rotations": "FJ4",
        "root_position": "F3",
        "bone_offsets": "J3",
    },
    SigmaGrid: {
        "across_values": "C",
        "along_values": "R",
        "sigma": "RC",
        "inside": "RC",
        "supported": "RC",
    },
    CrowdPoses: {
        "names": "J",
        "parents": "J",
        "rotations": "NJ4",
        "root_position": "N3",
        "bone_offsets": "NJ3",
        "duration": "N",
        "sigma": "N",
        "levels": "N",
        "error_px": "N",
        "supported": "N",
        "curve_names": "C",
        "curves": "NC",
    },
}
"""Axes of the arrays: a letter is one length throughout a response, a digit that length."""
WHOLE = ("levels", "inside", "supported", "parents", "names")
"""Fields that are not floating point."""


def _checked(found: T) -> T:
    """Return the value; raise ValueError if the shapes of its arrays are inconsistent."""
    sizes: dict[str, int] = {"3": 3, "4": 4}
    for name, axes in SHAPES[type(found)].items():
        each = getattr(found, name)
        if each is None:
            continue
        shape = np.shape(each)
        wanted = tuple(
            sizes.setdefault(axis, size) for axis, size in zip(axes, shape, strict=False)
        )
        if len(shape) != len(axes) or shape != wanted:
            raise ValueError(f"{name} has the shape {shape}, expected {', '.join(axes)} of {sizes}")
        if isinstance(each, np.ndarray) and (each.dtype.kind == "f") == (name in WHOLE):
            raise ValueError(f"{name} is of {each.dtype}")
    return found


_POSE = msgspec.msgpack.Decoder(Pose, dec_hook=_array)
_CLIP = msgspec.msgpack.Decoder(ClipNumbers, dec_hook=_array)
_PERFORMANCE = msgspec.msgpack.Decoder(PerformanceNumbers, dec_hook=_array)
_GRID = msgspec.msgpack.Decoder(SigmaGrid, dec_hook=_array)
_CROWD = msgspec.msgpack.Decoder(CrowdPoses, dec_hook=_array)


def pose(reply: Reply) -> Pose:
    """Return the poses of a MessagePack response; ValueError if it is invalid."""
    return _checked(_POSE.decode(reply.content))


def clip(reply: Reply) -> ClipNumbers:
    """Return the clip of a MessagePack response; ValueError if it is invalid."""
    return _checked(_CLIP.decode(reply.content))


def performance(reply: Reply) -> PerformanceNumbers:
    """Return the performance of a MessagePack response; ValueError if it is invalid."""
    return _checked(_PERFORMANCE.decode(reply.content))


def grid(reply: Reply) -> SigmaGrid:
    """Return the grid of a MessagePack response; ValueError if it is invalid."""
    return _checked(_GRID.decode(reply.content))


def crowd(reply: Reply) -> CrowdPoses:
    """Return the crowd's poses of a MessagePack response; ValueError if it is invalid."""
    return _checked(_CROWD.decode(reply.content))
