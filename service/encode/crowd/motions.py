"""The motions of a crowd, one after the other, as samples that USD takes."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from service.encode import character, crate, layers, specs
from service.encode.character import Rig
from service.encode.crate import Samples, Write
from service.encode.crowd import reach
from service.encode.crowd.reach import Hull
from service.motion import quat
from service.motion.conventions import Floats, Indices, Singles
from service.motion.crowd import CrowdClip, Motions

PRIM = "Motion"


@dataclass(frozen=True)
class Note:
    """What is kept of a motion once it is written: its box (2, 3), m, and its level of detail by
    the frames from which it holds."""

    box: Floats
    levels: dict[int, int]


@dataclass(frozen=True)
class Motion:
    """Samples of translations (F, J, 3) and of rotations (F, J, 4), real part last; its note."""

    samples: Samples
    note: Note


def count(crowd: CrowdClip) -> int:
    """How many motions the characters play."""
    return int(crowd.motion.max()) + 1


def each(crowd: CrowdClip, rig: Rig) -> Iterator[Motion]:
    """The motions in order; of the batches one is held, and none while the next is made.

    Raises ValueError where there are more or fewer than the characters play, or other frames.
    """
    made, hull = 0, reach.hull(crowd.skeleton.parents, rig)
    # A loop over the batches would hold on to each until it has the next.
    for motion in chain.from_iterable(map(partial(_of, crowd, hull), crowd.batches)):
        made += 1
        yield motion
    if made != count(crowd):
        raise ValueError(f"{made} motions, expected {count(crowd)}")


def author(prim: Any, samples: Samples) -> None:
    """Write the samples to a SkelAnimation."""
    moves = map(Vt.Vec3fArray.FromNumpy, samples["translations"])
    specs.samples(prim.layer, prim.path.AppendProperty("translations"), moves)
    turns = map(Vt.QuatfArray.FromNumpy, samples["rotations"])
    specs.samples(prim.layer, prim.path.AppendProperty("rotations"), turns)


@lru_cache(maxsize=8)
def writer(paths: tuple[str, ...], frames: int, rate: float) -> Write:
    """What writes binary layers of one motion each; kept, for it takes milliseconds to make."""
    joints = len(paths)
    shapes = {"translations": (frames, joints, 3), "rotations": (frames, joints, 4)}
    return crate.writer(lambda samples: layers.crate(_layer(paths, rate, samples)), shapes)


def _layer(paths: tuple[str, ...], rate: float, samples: Samples) -> Any:
    made = Sdf.Layer.CreateAnonymous("motion.usda")
    layers.head(made, PRIM, len(samples["rotations"]), rate)
    with Sdf.ChangeBlock():
        author(character.animation(made, PRIM, paths), samples)
    return made


def _of(crowd: CrowdClip, hull: Hull, batch: Motions) -> Iterator[Motion]:
    expected = (crowd.frames, len(crowd.skeleton), 4)
    if batch.rotations.shape[1:] != expected:
        raise ValueError(f"motions of {batch.rotations.shape[1:]}, expected {expected}")
    for index, box in enumerate(reach.boxes(hull, batch)):
        yield Motion(_samples(batch, index), Note(box, _changes(batch.levels[index])))


def _samples(batch: Motions, index: int) -> Samples:
    path, turns = batch.root_position[index], quat.unroll(batch.rotations[index])
    moves = np.empty((*turns.shape[:-1], 3), np.float32)
    moves[:], moves[:, 0] = batch.bone_offsets[index], path
    return {"translations": moves, "rotations": _last(turns)}


def _last(turns: Floats) -> Singles:
    """The same with the real part last, as it is in USD's memory."""
    swapped = np.empty(turns.shape, np.float32)
    swapped[..., :3], swapped[..., 3] = turns[..., 1:], turns[..., 0]
    return swapped


def _changes(levels: Indices) -> dict[int, int]:
    """Level by frame, of the first frame and of those whose level is not the frame's before."""
    changed = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1))
    return {int(frame): int(levels[frame]) for frame in changed}
