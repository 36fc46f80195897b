"""Checks of a skeleton's joints: names, order, and rest and bind transforms."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from posefield.check import skeleton_bindings as rigs
from posefield.check.finding import Finding, error, first_values
from posefield.check.skeleton_bindings import SkeletonBinding
from posefield.common.units import Floats

LEGAL = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

# Far above the relative error of float32, 1e-7, in which many files have been.
ORTHONORMAL_TOLERANCE = 1e-4


def names(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on joint names that are missing, illegal or not unique."""
    if not rig.joints:
        yield error("no-joints", rig.skeleton, "no joints, expected at least one")
    illegal = [leaf for leaf in dict.fromkeys(rig.leaves) if not LEGAL.fullmatch(leaf)]
    if illegal:
        message = f"joint names {first_values(illegal)}, expected {LEGAL.pattern}"
        yield error("illegal-joint-name", rig.skeleton, message)
    repeated = _repeated(rig.joints)
    if repeated:
        message = f"joints listed more than once: {first_values(repeated)}; expected each path once"
        yield error("duplicate-joint", rig.skeleton, message)
    shared = [leaf for leaf in _repeated(rig.leaves) if leaf not in _leaves(repeated)]
    if shared:
        message = (
            f"leaf names of several joints: {first_values(shared)}; expected each leaf name once"
        )
        yield error("duplicate-leaf-name", rig.skeleton, message)


def order(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on joints whose parent is listed after them, or not at all."""
    places = {joint: place for place, joint in reversed(list(enumerate(rig.joints)))}
    parents = [(joint, joint.rpartition("/")[0]) for joint in rig.joints if "/" in joint]
    early = [j for j, parent in parents if parent in places and places[parent] > places[j]]
    orphans = [j for j, parent in parents if parent not in places]
    if early:
        message = f"listed before their parents: {first_values(early)}; expected parents first"
        yield error("child-before-parent", rig.skeleton, message)
    if orphans:
        message = (
            f"parents are not listed: {first_values(orphans)}; expected every ancestor as a joint"
        )
        yield error("missing-parent", rig.skeleton, message)


def transforms(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on rest and bind transforms that are missing, miscounted or not rigid."""
    for name in ("restTransforms", "bindTransforms"):
        if not rigs.is_authored(rig.skeleton, name):
            message = f"no {name}, expected one matrix for each of {len(rig.joints)} joints"
            yield error(f"missing-{name}", rig.skeleton, message)
            continue
        matrices = rigs.attribute_array(rig.skeleton, name).reshape(-1, 4, 4)
        if len(matrices) != len(rig.joints):
            message = f"{len(matrices)} {name}, expected {len(rig.joints)}, one a joint"
            yield error(f"{name}-count", rig.skeleton, message)
        yield from _rigid(rig, name, matrices)


def _rigid(rig: SkeletonBinding, name: str, matrices: Floats) -> Iterator[Finding]:
    if not np.all(np.isfinite(matrices)):
        message = f"{name} with infinite or undefined numbers, expected finite ones"
        yield error("not-finite", rig.skeleton, message)
        return
    turns = matrices[:, :3, :3]
    square = np.abs(turns @ np.swapaxes(turns, -1, -2) - np.eye(3)).max(axis=(-1, -2))
    wrong = np.flatnonzero((square > ORTHONORMAL_TOLERANCE) | (np.linalg.det(turns) < 0)).tolist()
    if wrong:
        message = (
            f"{name} of joints {first_values(wrong)} scale, shear or mirror; expected rotations"
        )
        yield error("not-orthonormal", rig.skeleton, message)


def _repeated(names: Iterable[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]


def _leaves(joints: Iterable[str]) -> set[str]:
    return {joint.rpartition("/")[2] for joint in joints}
