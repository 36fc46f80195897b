"""NumPy arrays from binary responses; arrays are read-only views of the received bytes."""

from collections.abc import Callable
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

import msgspec
import numpy as np
import numpy.typing as npt
from msgspec import Struct

from posefield_client.generated import PerformanceReport, Trust
from posefield_client.wire import Reply

T = TypeVar("T", bound="Arrays")
Array = npt.NDArray[Any]
KINDS = "fiub"


class Arrays(Struct, frozen=True, eq=False, kw_only=True):
    """Answer with arrays, of which people are shown the shapes.

    A field is annotated with its axes: a letter is one length throughout an answer, a digit that
    length.
    """

    def __repr__(self) -> str:
        shown = (f"{name}={_short(getattr(self, name))}" for name in self.__struct_fields__)
        return f"{type(self).__name__}({', '.join(shown)})"


def _short(value: Any) -> str:
    """Return an array as its type and shape, a list of names as its length, and Trust in short."""
    if isinstance(value, np.ndarray):
        return f"<{value.dtype} {value.shape}>"
    if isinstance(value, Trust):
        return f"<{value.model}, sigma {value.sigma:.3g} m>"
    if isinstance(value, PerformanceReport):
        return f"<{len(value.segments)} segments, sigma {value.sigma:.3g} m>"
    return f"<{len(value)} items>" if isinstance(value, tuple) and len(value) > 3 else repr(value)


class Pose(Arrays, frozen=True, eq=False, kw_only=True):
    """Poses at S times of the J joints that the model's card names.

    times: s. rotations: unit quaternions w x y z, local to the parent. root_position,
    bone_offsets: m. curves: values of the C curves that the card names; None without curves.
    """

    trust: Trust
    times: Annotated[Array, "S"]
    rotations: Annotated[Array, "SJ4"]
    root_position: Annotated[Array, "S3"]
    bone_offsets: Annotated[Array, "J3"]
    curves: Annotated[Array, "SC"] | None = None


class _Motion(Arrays, frozen=True, eq=False, kw_only=True):
    units: dict[str, str]
    names: Annotated[tuple[str, ...], "J"]
    parents: Annotated[tuple[int, ...], "J"]
    rate: float
    times: Annotated[Array, "F"]
    rotations: Annotated[Array, "FJ4"]
    root_position: Annotated[Array, "F3"]
    bone_offsets: Annotated[Array, "J3"]
    curve_names: Annotated[tuple[str, ...], "C"] = ()
    curves: Annotated[Array, "FC"] | None = None


class ClipNumbers(_Motion, frozen=True, eq=False, kw_only=True):
    """A clip of F frames of J joints, with arrays as in Pose.

    rate: frames per second. names, parents: of the joints; the root's parent is -1. units: of the
    arrays, by name. curve_names: of the C curves; empty for a model without curves.
    """

    trust: Trust


class PerformanceNumbers(_Motion, frozen=True, eq=False, kw_only=True):
    """A performance of F frames of J joints, with arrays as in ClipNumbers and its own report."""

    trust: PerformanceReport


class SigmaGrid(Arrays, frozen=True, eq=False, kw_only=True):
    """Sigma over two controls, in C columns and R rows.

    controls: values of the other controls. sigma: m. inside: True within all sampled ranges.
    supported: True near captured clips; None from services that do not report it.
    """

    model: str
    across: str
    along: str
    controls: dict[str, float]
    performer: str | None
    units: dict[str, str]
    across_values: Annotated[Array, "C"]
    along_values: Annotated[Array, "R"]
    sigma: Annotated[Array, "RC"]
    inside: Annotated[Array, "RC"]
    supported: Annotated[Array, "RC"] | None = None


class CrowdPoses(Arrays, frozen=True, eq=False, kw_only=True):
    """One pose each of N characters of J joints, in the order of the request.

    rotations: the root's in world space. root_position: in world space, m. bone_offsets: m.
    duration: s. sigma: m. error_px: None without a camera. supported: True near captured clips;
    None from services that do not report it. curves: None for a model without them.
    """

    model: str
    names: Annotated[tuple[str, ...], "J"]
    parents: Annotated[tuple[int, ...], "J"]
    units: dict[str, str]
    warnings: tuple[str, ...]
    rotations: Annotated[Array, "NJ4"]
    root_position: Annotated[Array, "N3"]
    bone_offsets: Annotated[Array, "NJ3"]
    duration: Annotated[Array, "N"]
    sigma: Annotated[Array, "N"]
    levels: Annotated[Array, "N"]
    error_px: Annotated[Array, "N"] | None = None
    supported: Annotated[Array, "N"] | None = None
    curve_names: Annotated[tuple[str, ...], "C"] = ()
    curves: Annotated[Array, "NC"] | None = None


def decoder(kind: type[T]) -> Callable[[Reply], T]:
    """Return the decoder of a MessagePack response, which raises ValueError for an invalid one."""
    packed = msgspec.msgpack.Decoder(kind, dec_hook=_array)
    axes = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        # The annotation is the type itself, or the first part of a union with None.
        for part in (hint, *get_args(hint)):
            if isinstance(letters := getattr(part, "__metadata__", [None])[0], str):
                axes[name] = letters
    return lambda reply: _checked(packed.decode(reply.content), axes)


def _array(_: type, packed: Any) -> Array:
    """Return an array from its encoding: a map of `dtype`, `shape`, and little-endian `data`."""
    if not isinstance(packed, dict) or not packed.keys() >= {"dtype", "shape", "data"}:
        raise ValueError("expected a map of dtype, shape and data")
    dtype = np.dtype(packed["dtype"])
    if dtype.kind not in KINDS:
        raise ValueError(f"an array of {packed['dtype']}, expected numbers")
    return np.frombuffer(packed["data"], dtype).reshape(packed["shape"])


def _checked(answer: T, axes: dict[str, str]) -> T:
    """Return the answer; raise ValueError if the shapes of its arrays are inconsistent."""
    sizes: dict[str, int] = {"3": 3, "4": 4}
    for name, letters in axes.items():
        value = getattr(answer, name)
        if value is None:
            continue
        shape = np.shape(value)
        expected = tuple(
            sizes.setdefault(axis, size) for axis, size in zip(letters, shape, strict=False)
        )
        if len(shape) != len(letters) or shape != expected:
            raise ValueError(
                f"{name} has the shape {shape}, expected {', '.join(letters)} of {sizes}"
            )
    return answer
