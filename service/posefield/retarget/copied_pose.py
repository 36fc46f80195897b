"""Orientations of a motion copied to a rig, whose other joints keep their rest."""

from collections.abc import Collection
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Rotations
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.skeleton import joint_chain
from posefield.retarget import rest_alignment
from posefield.retarget.rest_alignment import Soles
from posefield.retarget.role_map import Body, Chain


def copy_orientations(
    source: Body, rig: Body, turns: Annotated[Floats, "frames _ 4"], soles: Soles
) -> Rotations:
    """Return the local rotations (F, J, 4) of the rig.

    turns (F, S, 4): orientations of the motion's joints. soles: as of `align_rests`. Joints of
    spine and neck follow the motion's by their places along the chain. Others without a role follow
    a joint of the same name, as its part of the body does; without one they keep their rest against
    their parents.
    """
    aligned = rest_alignment.align_rests(source, rig, soles)
    world: dict[int, Floats] = {
        rig.joints[role]: quat.mul(turns[:, source.joints[role]], own)
        for role, own in aligned.items()
    }
    aligned_joints = {rig.joints[role]: own for role, own in aligned.items()}
    whole = aligned["hips"]
    for mine, theirs in ((rig.spine, source.spine), (rig.neck, source.neck)):
        if mine.joints and theirs.joints:
            for joint, place in zip(mine.joints, mine.places.tolist(), strict=True):
                world[joint] = quat.mul(_along(theirs, turns, place), whole)
    for joint, namesake in _namesakes(source, rig, set(world)).items():
        if (above := _nearest(rig.parents, joint, aligned_joints)) is not None:
            world[joint] = quat.mul(turns[:, namesake], aligned_joints[above])
    return _local(rig.parents, world, len(turns))


def _namesakes(source: Body, rig: Body, known: set[int]) -> dict[int, int]:
    """Return the joints without a role whose names both skeletons have, by joint of the rig."""
    taken = set(source.joints.values())
    free = {name: joint for joint, name in enumerate(source.names) if joint not in taken}
    return {
        joint: free[name]
        for joint, name in enumerate(rig.names)
        if joint not in known and name in free
    }


def _nearest(parents: tuple[int, ...], joint: int, some: Collection[int]) -> int | None:
    """Return the nearest of some joints above a joint; None without one."""
    return next((own for own in joint_chain(parents, joint)[-2::-1] if own in some), None)


def _along(chain: Chain, turns: Annotated[Floats, "frames _ 4"], place: float) -> Floats:
    """Return the orientation (F, 4) at a place, 0 to 1, of a chain."""
    after = min(int(np.searchsorted(chain.places, place - 1e-9)), len(chain.joints) - 1)
    before = max(after - 1, 0)
    first, last = chain.places[before], chain.places[after]
    if last - place < 1e-9 or last <= first:
        return turns[:, chain.joints[after]]
    share = np.array((place - first) / (last - first))
    found: Floats = quat.slerp(turns[:, chain.joints[before]], turns[:, chain.joints[after]], share)
    return found


def _local(parents: tuple[int, ...], world: dict[int, Floats], frames: int) -> Rotations:
    """Return local rotations (F, J, 4) of joints of which some have a known orientation."""
    found = np.empty((frames, len(parents), 4))
    found[:] = quat.IDENTITY
    turns: list[Floats] = []
    for joint, parent in enumerate(parents):
        above = turns[parent] if parent >= 0 else np.broadcast_to(quat.IDENTITY, (frames, 4))
        if joint in world:
            found[:, joint] = quat.mul(quat.conj(above), world[joint])
            turns.append(world[joint])
        else:
            turns.append(above)
    return found
