"""Pickles of other programs, of which nothing but arrays and plain containers is made.

A pickle names functions and calls them, so that a file of unknown origin may run any code. Here a
name stands for one of the few functions below, which build arrays, and any other name is refused
before it is looked up. Arrays that joblib writes behind their pickle are read as well.
"""

import io
import pickle
from collections import OrderedDict
from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.common.errors import MotionFileError

Array = npt.NDArray[Any]


class _Stream:
    """Bytes that are read exactly as far as is asked, as arrays stand between the opcodes."""

    def __init__(self, content: bytes) -> None:
        self.file = io.BytesIO(content)
        self.read, self.readline = self.file.read, self.file.readline


def _plain(dtype: "np.dtype[Any]") -> "np.dtype[Any]":
    if dtype.hasobject:
        raise PermissionError("an array of Python objects")
    return dtype


def _empty_array(*_: Any) -> Array:
    """Return an array that its state fills; what a file says of its size is not allocated."""
    return np.empty(0)


def _array_of_bytes(content: Any, dtype: Any, shape: tuple[int, ...], order: str) -> Array:
    rows = np.frombuffer(content, _plain(np.dtype(dtype)))
    return rows.reshape(shape, order="F" if order == "F" else "C")


def _scalar(dtype: "np.dtype[Any]", content: bytes = b"") -> Any:
    return np.frombuffer(content, _plain(dtype))[0].item()


class _JoblibArray:
    """Stands for joblib's wrapper of an array that follows in the stream."""

    array: Array


def _joblib_array(stream: _Stream) -> type[_JoblibArray]:
    """Return the class of wrappers that read their array from a stream."""

    class JoblibArray(_JoblibArray):
        def __setstate__(self, state: dict[str, Any]) -> None:
            dtype = _plain(state["dtype"])
            if state.get("numpy_array_alignment_bytes"):
                stream.read(stream.read(1)[0])
            content = stream.read(int(np.prod(state["shape"])) * dtype.itemsize)
            self.array = _array_of_bytes(content, dtype, state["shape"], state["order"])

    return JoblibArray


class _Unpickler(pickle.Unpickler):
    def __init__(self, stream: _Stream) -> None:
        super().__init__(stream, encoding="latin1")
        arrays = ("numpy.core", "numpy._core")
        self.known: dict[tuple[str, str], Any] = {
            ("numpy", "ndarray"): np.ndarray,
            ("numpy", "dtype"): np.dtype,
            ("collections", "OrderedDict"): OrderedDict,
            ("_codecs", "encode"): lambda text, coding="latin1": text.encode(coding),
            ("joblib.numpy_pickle", "NumpyArrayWrapper"): _joblib_array(stream),
            **{(f"{name}.multiarray", "_reconstruct"): _empty_array for name in arrays},
            **{(f"{name}.multiarray", "scalar"): _scalar for name in arrays},
            **{(f"{name}.numeric", "_frombuffer"): _array_of_bytes for name in arrays},
        }

    def find_class(self, module: str, name: str) -> Any:
        """Return what stands for a name of the file; any name but the known ones is refused."""
        try:
            return self.known[module, name]
        except KeyError:
            raise PermissionError(f"{module}.{name}") from None


def load(content: bytes, source: str) -> Any:
    """Return the containers and arrays of a pickle, with the arrays of joblib in their places.

    Raises MotionFileError for a pickle that is broken, compressed or holds anything else.
    """
    try:
        value = _Unpickler(_Stream(content)).load()
    except PermissionError as fault:
        raise MotionFileError(
            source,
            f"holds {fault}, expected NumPy arrays, numbers, text and plain containers: nothing "
            "else of a pickle is loaded, since it may run code",
        ) from None
    except Exception as fault:
        raise MotionFileError(source, f"is no pickle that can be read: {fault}") from None
    return _with_arrays(value)


def _with_arrays(value: Any, depth: int = 0) -> Any:
    """Return a value with arrays in place of wrappers, as deep as files of motions go."""
    if isinstance(value, _JoblibArray):
        return value.array
    if isinstance(value, dict) and depth < 3:
        return {key: _with_arrays(item, depth + 1) for key, item in value.items()}
    return value
