"""Bones as arrays: rest pose of a new armature, and channels that pose any armature.

The axes of a bone depend on its armature: Y points along it. With the bone's rest matrix A, the
joint's rotation q (in the axes of the armature, local to the parent) is the channel A^-1 q A, which
rotates the joint as the service intends, whatever the bone's axes.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import axes, faults
from .clips import Clip

Floats = npt.NDArray[np.float64]

SHORTEST = 0.01
"""Least length of a bone, m; Blender removes bones of zero length."""

LISTED = 4
"""Largest number of joints named in a message."""

LONGEST_NAME = 63
"""Limit of a bone's name, bytes."""


@dataclass(frozen=True)
class Rest:
    """Rest pose of an armature.

    matrices: of its bones in its own space (J, 4, 4), in the clip's order. scale: metres of the
    scene per unit of the armature.
    """

    matrices: Floats
    scale: float = 1.0

    @property
    def heads(self) -> Floats:
        """Return the heads of the bones (J, 3), in the armature's units."""
        return self.matrices[:, :3, 3]

    @property
    def turns(self) -> Floats:
        """Return unit quaternions (J, 4) of the bones' own axes."""
        return axes.of_matrices(self.matrices[:, :3, :3])

    def offsets(self, parents: list[int]) -> Floats:
        """Return the offsets from the parents' heads (J, 3); the root's is its head."""
        found = self.heads.copy()
        found[1:] -= self.heads[parents[1:]]
        return found


@dataclass(frozen=True)
class Channels:
    """Values to key.

    turns: rotations (F, J, 4). path: locations of the root (F, 3). shifts: constant locations of
    the other bones (J, 3).
    """

    turns: Floats
    path: Floats
    shifts: Floats


def channels(clip: Clip, rest: Rest, keep_lengths: bool) -> Channels:
    """Return the channels that pose an armature as the clip.

    keep_lengths: True to keep the armature's joints at their bone lengths; False to move them to
    the clip's positions.
    """
    own = rest.turns
    parents = parent_indices(clip)
    shifts = np.zeros_like(clip.offsets)
    if not keep_lengths:
        shifts = _turned(axes.conj(own), clip.offsets / rest.scale - rest.offsets(parents))
    shifts[0] = 0.0
    path = _turned(axes.conj(own[0]), clip.path / rest.scale - rest.heads[0])
    turns = axes.mul(axes.mul(axes.conj(own), clip.rotations), own)
    return Channels(axes.unrolled(turns), path, shifts)


def at_rest(clip: Clip) -> Floats:
    """Return heads (J, 3), m, of a new armature that stands on the ground over the origin."""
    heads = clip.offsets.copy()
    heads[0] = 0.0
    for joint, parent in list(enumerate(parent_indices(clip)))[1:]:
        heads[joint] += heads[parent]
    heads[:, 2] -= heads[:, 2].min()
    return heads


def tails(clip: Clip, heads: Floats, tips: dict[str, tuple[float, float, float]]) -> Floats:
    """Return the tails of a new armature's bones (J, 3): their children's mean, else their tips."""
    parents = np.array(parent_indices(clip))
    ends = np.empty_like(heads)
    for joint, name in enumerate(clip.names):
        children = np.flatnonzero(parents == joint)
        if len(children):
            reach = heads[children].mean(axis=0) - heads[joint]
        else:
            reach = axes.z_up(np.array(tips.get(name, (0.0, 0.0, 0.0))))
        if np.linalg.norm(reach) < SHORTEST:
            reach = _onward(joint, parents[joint], heads)
        ends[joint] = heads[joint] + reach
    return ends


def check(clip: Clip, found: dict[str, str | None]) -> None:
    """Raise Mismatch for an armature with other joints than the clip's.

    found: parent of each of its bones.
    """
    missing = [name for name in clip.names if name not in found]
    superfluous = [name for name in found if name not in clip.parents]
    elsewhere = [
        f"{name} (child of {found[name]}, expected {parent})"
        for name, parent in clip.parents.items()
        if name in found and found[name] != parent
    ]
    said = [
        f"{what} {_listed(names)}"
        for what, names in (
            ("it lacks", missing),
            ("it has besides", superfluous),
            ("elsewhere in the tree:", elsewhere),
        )
        if names
    ]
    if said:
        raise faults.Mismatch(
            f"the armature has {len(found)} bones, the clip {len(clip.names)} joints: "
            + "; ".join(said)
        )


def check_names(clip: Clip) -> None:
    """Raise Mismatch for names that Blender would truncate."""
    longest = max(clip.names, key=lambda name: len(name.encode()))
    if len(longest.encode()) > LONGEST_NAME:
        raise faults.Mismatch(
            f"joint {longest} has {len(longest.encode())} bytes, a bone's name at most"
            f" {LONGEST_NAME}"
        )


def differences(clip: Clip, rest: Rest) -> list[str]:
    """Return notes on differences in rest pose and bone lengths that are not transferred."""
    own = rest.offsets(parent_indices(clip)) * rest.scale
    lengths = np.linalg.norm(own, axis=-1), np.linalg.norm(clip.offsets, axis=-1)
    apart = np.abs(lengths[0] - lengths[1])
    apart[0] = 0.0
    joint, said = int(apart.argmax()), []
    if apart[joint] > 1e-3:
        said.append(
            f"bone lengths stay the armature's, up to {100 * apart[joint]:.1f} cm off the clip's"
            f" ({clip.names[joint]})"
        )
    cosines = (own * clip.offsets).sum(axis=-1) / np.maximum(lengths[0] * lengths[1], 1e-12)
    cosines[np.minimum(*lengths) < SHORTEST] = 1.0
    joint = int(cosines[1:].argmin()) + 1 if len(cosines) > 1 else 0
    turned = np.degrees(np.arccos(np.clip(cosines[joint], -1, 1)))
    if joint and turned > 1.0:
        said.append(
            f"the rest poses differ, by {turned:.0f} degrees at {clip.names[joint]}: turns are"
            " counted from the armature's own"
        )
    return said


def heading_left(clip: Clip) -> float:
    """Return the rotation of the root from the first frame to the last, rad."""
    first, last = clip.rotations[0, 0], clip.rotations[-1, 0]
    return float(axes.angle(axes.mul(last, axes.conj(first))))


def parent_indices(clip: Clip) -> list[int]:
    """Return the index of each joint's parent, -1 for the root."""
    places = {name: index for index, name in enumerate(clip.names)}
    return [-1 if parent is None else places[parent] for parent in clip.parents.values()]


def _turned(turns: Floats, vectors: Floats) -> Floats:
    pure = np.concatenate([np.zeros_like(vectors[..., :1]), vectors], axis=-1)
    return axes.mul(axes.mul(turns, pure), axes.conj(turns))[..., 1:]


def _onward(joint: int, parent: int, heads: Floats) -> Floats:
    """Return a short bone in the direction from its parent; upward if that has no length."""
    way = heads[joint] - heads[parent] if parent >= 0 else np.zeros(3)
    length = float(np.linalg.norm(way))
    if length < SHORTEST:
        return np.array([0.0, 0.0, 5 * SHORTEST])
    onward: Floats = way * (max(SHORTEST, 0.3 * length) / length)
    return onward


def _listed(names: list[str]) -> str:
    more = len(names) - LISTED
    return ", ".join(names[:LISTED]) + (f" and {more} more" if more > 0 else "")
