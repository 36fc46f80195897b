"""Binary USD layers that differ in their samples alone: one is written, the others are filled in.

usd-core takes a millisecond for a layer whose samples NumPy copies to their places in fifty
microseconds. The places are not looked up in the format: a layer is written with numbers that
occur once, they are looked for, and what is filled in must be what usd-core writes, to the byte.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from service.motion.conventions import Singles

Bytes = npt.NDArray[np.uint8]
Samples = Mapping[str, Singles]
"""By name the samples (F, ...) of an attribute at the time codes 0 to F - 1."""
Write = Callable[[Samples], bytes]


@dataclass(frozen=True)
class Slot:
    """Where the samples of one attribute lie: from offset on, one every stride bytes."""

    offset: int
    stride: int
    frames: int
    width: int

    def of(self, content: Bytes) -> Bytes:
        """The samples' bytes (frames, width), which can be written."""
        shape, strides = (self.frames, self.width), (self.stride, 1)
        return np.lib.stride_tricks.as_strided(content[self.offset :], shape, strides)


@dataclass(frozen=True)
class Template:
    """A layer's bytes, and where in them each attribute's samples lie."""

    content: Bytes
    slots: Mapping[str, Slot]

    def write(self, samples: Samples) -> bytes:
        """The layer with other samples, of the shapes that it was made for.

        Equal samples are written as often as they occur: usd-core would write them once.
        """
        content = self.content.copy()
        for name, slot in self.slots.items():
            slot.of(content)[:] = _bytes(samples[name])
        return content.tobytes()


def writer(write: Write, shapes: Mapping[str, tuple[int, ...]]) -> Write:
    """What writes the same layers as `write`, by a template where one can be made.

    write: the ordinary way from samples to the bytes of a binary layer. shapes (F, ...): of each
    attribute's samples, of 32-bit floats.
    """
    made = template(write, shapes)
    return write if made is None else made.write


def template(write: Write, shapes: Mapping[str, tuple[int, ...]]) -> Template | None:
    """Template of the layers that `write` makes, or None where it cannot be trusted.

    It can where every sample lies in the file once, evenly spaced, and where filling in other
    samples gives the bytes that `write` gives.
    """
    rng = np.random.default_rng(0)
    marks, others = ({name: _marks(rng, shapes[name]) for name in shapes} for _ in range(2))
    content = write(marks)
    slots = {name: _slot(content, _bytes(mark)) for name, mark in marks.items()}
    found = {name: slot for name, slot in slots.items() if slot is not None}
    made = Template(np.frombuffer(content, np.uint8), found)
    return made if len(found) == len(slots) and made.write(others) == write(others) else None


def _marks(rng: np.random.Generator, shape: tuple[int, ...]) -> Singles:
    return rng.standard_normal(shape, dtype=np.float32)


def _slot(content: bytes, marks: Bytes) -> Slot | None:
    frames, width = marks.shape
    places = [content.find(mark.tobytes()) for mark in marks[:2]]
    # A single sample has nothing to be apart from.
    stride = places[1] - places[0] if frames > 1 else width
    inside = places[0] >= 0 and places[0] + stride * (frames - 1) + width <= len(content)
    if not inside or stride < width or content.count(marks[0].tobytes()) != 1:
        return None
    slot = Slot(places[0], stride, frames, width)
    evenly = np.array_equal(slot.of(np.frombuffer(content, np.uint8)), marks)
    return slot if evenly else None


def _bytes(samples: Singles) -> Bytes:
    return np.ascontiguousarray(samples, np.float32).view(np.uint8).reshape(len(samples), -1)
