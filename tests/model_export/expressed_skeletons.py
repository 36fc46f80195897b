"""Motions expressed by other skeletons: frames of a rest pose, order of joints, helper joints."""

from dataclasses import replace

import numpy as np

from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton


def random_turns(count, seed, largest=0.8):
    """Turns (J, 4) of the joints' frames of up to some angle, rad; none of the root's."""
    rng = np.random.default_rng(seed)
    turns = quat.exp(rng.uniform(-largest / 2, largest / 2, (count, 3)))
    turns[0] = (1.0, 0.0, 0.0, 0.0)
    return turns


def with_rest(clip, turns):
    """The same motion in frames that are turned, as of files with another rest pose."""
    own = clip.skeleton
    _, world = skeleton.forward_kinematics(own.parents, clip.rotations, clip.translations)
    frames = quat.mul(world, quat.conj(turns))
    rotations, translations = frames.copy(), clip.translations.copy()
    for joint, parent in list(enumerate(own.parents))[1:]:
        rotations[:, joint] = quat.mul(quat.conj(frames[:, parent]), frames[:, joint])
        translations[:, joint] = quat.rotate(turns[parent], translations[:, joint])
    offsets = quat.rotate(turns[list(own.parents)], own.offsets)
    tips = quat.rotate(turns[list(own.tip_joints)], own.tip_offsets)
    turned = replace(own, offsets=offsets, tip_offsets=tips)
    return replace(clip, skeleton=turned, rotations=rotations, translations=translations)


def in_order(clip, order):
    """The same motion with the joints in another order, each parent before its children."""
    own, places = clip.skeleton, list(order)
    joints = Skeleton(
        tuple(own.names[joint] for joint in order),
        tuple(places.index(own.parents[joint]) if joint else -1 for joint in order),
        own.offsets[places],
        tuple(places.index(joint) for joint in own.tip_joints),
        own.tip_offsets,
    )
    rotations, translations = clip.rotations[:, places], clip.translations[:, places]
    return replace(clip, skeleton=joints, rotations=rotations, translations=translations)


def arms_first(clip):
    """The same motion with the legs at the end of the list of joints."""
    names = clip.skeleton.names
    legs = [j for j, name in enumerate(names) if name.endswith(("Leg", "Foot", "ToeBase"))]
    return in_order(clip, [j for j in range(len(names)) if j not in legs] + legs)


def with_joint(clip, name, parent, share=0.0):
    """The clip with a joint that does not turn between a joint and its parent, at a share."""
    own = clip.skeleton
    child = own.names.index(parent)
    above = own.parents[child]
    parents = [p + (p >= child) for p in own.parents]
    parents[child] = child
    names = (*own.names[:child], name, *own.names[child:])
    local = clip.translations.copy()
    between = share * local[:, child]
    local[:, child] -= between
    offsets = own.offsets.copy()
    offsets[child] *= 1.0 - share
    joints = Skeleton(
        names,
        (*parents[:child], above, *parents[child:]),
        np.insert(offsets, child, share * own.offsets[child], axis=0),
        tuple(joint + (joint >= child) for joint in own.tip_joints),
        own.tip_offsets,
    )
    rotations = np.insert(clip.rotations, child, quat.IDENTITY, axis=1)
    translations = np.insert(local, child, between, axis=1)
    return Clip(joints, rotations, translations, clip.rate)


def renamed(clip, names):
    """The clip with other names of joints. names: new by old."""
    own = clip.skeleton
    found = tuple(names.get(name, name) for name in own.names)
    return replace(clip, skeleton=replace(own, names=found))
