"""Bones as numbers: where a new armature's lie, and what poses any armature as a clip says.

A bone's own axes are its armature's choice: Y points along it. With the bone's rest matrix A, the
joint's rotation q (in the axes of the armature, local to the parent) is the channel A^-1 q A: then
the joint turns as the service says, whatever the bone's axes are.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import axes, faults
from .clips import Clip

Floats = npt.NDArray[np.float64]

SHORTEST = 0.01
"""Length of a bone that leads nowhere, m; Blender drops bones without length."""

LISTED = 4
"""Joints that a message names."""

LONGEST_NAME = 63
"""Bytes of a bone's name."""


@dataclass(frozen=True)
class Rest:
    """An armature at rest: matrices (J, 4, 4) of its bones in its own space, in the clip's order.

    scale: metres of the scene that one of its units is.
    """

    matrices: Floats
    scale: float = 1.0

    @property
    def heads(self) -> Floats:
        """Where the bones begin (J, 3), in the armature's units."""
        return self.matrices[:, :3, 3]

    @property
    def turns(self) -> Floats:
        """Unit quaternions (J, 4) of the bones' own axes."""
        return axes.of_matrices(self.matrices[:, :3, :3])

    def offsets(self, parents: list[int]) -> Floats:
        """From the parents' heads (J, 3); the root's is its head."""
        found = self.heads.copy()
        found[1:] -= self.heads[parents[1:]]
        return found


@dataclass(frozen=True)
class Channels:
    """What is keyed: turns (F, J, 4) and places (F, 3) of the root, and shifts (J, 3) of the other
    bones, which hold for all frames."""

    turns: Floats
    path: Floats
    shifts: Floats


def channels(clip: Clip, rest: Rest, keep_lengths: bool) -> Channels:
    """Channels that pose an armature as the clip says.

    Where the armature keeps its lengths nothing shifts; else its joints lie where the clip's do.
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
    """Heads (J, 3) of a new armature, which stands on the ground over the origin, m."""
    heads = clip.offsets.copy()
    heads[0] = 0.0
    for joint, parent in list(enumerate(parent_indices(clip)))[1:]:
        heads[joint] += heads[parent]
    heads[:, 2] -= heads[:, 2].min()
    return heads


def tails(clip: Clip, heads: Floats, tips: dict[str, tuple[float, float, float]]) -> Floats:
    """Where the bones of a new armature end (J, 3): among their children, else at their tips."""
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
    """Refuse an armature, given as its bones' parents, whose joints are not the clip's."""
    missing = [name for name in clip.names if name not in found]
    superfluous = [name for name in found if name not in clip.parents]
    elsewhere = [
        f"{name} (hangs on {found[name]}, expected {parent})"
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
    """Refuse names that Blender would cut."""
    longest = max(clip.names, key=lambda name: len(name.encode()))
    if len(longest.encode()) > LONGEST_NAME:
        raise faults.Mismatch(
            f"joint {longest} has {len(longest.encode())} bytes, a bone's name at most"
            f" {LONGEST_NAME}"
        )


def differences(clip: Clip, rest: Rest) -> list[str]:
    """What an armature that keeps its lengths does not take over, in words."""
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
    """How far the root has turned from the first frame to the last, rad."""
    first, last = clip.rotations[0, 0], clip.rotations[-1, 0]
    return float(axes.angle(axes.mul(last, axes.conj(first))))


def parent_indices(clip: Clip) -> list[int]:
    """Index of each joint's parent, -1 for the root."""
    places = {name: index for index, name in enumerate(clip.names)}
    return [-1 if parent is None else places[parent] for parent in clip.parents.values()]


def _turned(turns: Floats, vectors: Floats) -> Floats:
    pure = np.concatenate([np.zeros_like(vectors[..., :1]), vectors], axis=-1)
    return axes.mul(axes.mul(turns, pure), axes.conj(turns))[..., 1:]


def _onward(joint: int, parent: int, heads: Floats) -> Floats:
    """A short bone in the direction in which its parent leads to it; upward, if in none."""
    way = heads[joint] - heads[parent] if parent >= 0 else np.zeros(3)
    length = float(np.linalg.norm(way))
    if length < SHORTEST:
        return np.array([0.0, 0.0, 5 * SHORTEST])
    onward: Floats = way * (max(SHORTEST, 0.3 * length) / length)
    return onward


def _listed(names: list[str]) -> str:
    more = len(names) - LISTED
    return ", ".join(names[:LISTED]) + (f" and {more} more" if more > 0 else "")
