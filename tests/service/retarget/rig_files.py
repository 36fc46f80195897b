"""Characters for tests: skeletons in other proportions and rest poses, as GLB and USD files."""

import json
import struct
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel, Vt

from posefield.motion import quat


@dataclass(frozen=True)
class Figure:
    """Joints of a character at rest.

    offsets (J, 3): from the parent in the world, m. frames (J, 4): orientation of each joint's
    axes in the world.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray
    frames: np.ndarray

    def index(self, name):
        return self.names.index(name)

    def below(self, name):
        """Indices of a joint and of all below it."""
        found = {self.index(name)}
        for joint, parent in enumerate(self.parents):
            found |= {joint} if parent in found else set()
        return sorted(found)

    def longer(self, factor, *names):
        """The figure with the bones that end at joints longer by a factor."""
        offsets = self.offsets.copy()
        offsets[[self.index(name) for name in names]] *= factor
        return replace(self, offsets=offsets)

    def turned(self, name, axis, degrees):
        """The figure with all below a joint turned at rest."""
        turn = quat.from_axis_angle(np.array(axis, float), np.array(np.radians(degrees)))
        own = self.below(name)
        offsets, frames = self.offsets.copy(), self.frames.copy()
        offsets[own[1:]] = quat.rotate(turn, offsets[own[1:]])
        frames[own] = quat.mul(turn, frames[own])
        return replace(self, offsets=offsets, frames=frames)

    def framed(self, seed):
        """The figure with any axes of its joints."""
        frames = np.random.default_rng(seed).normal(size=self.frames.shape)
        return replace(self, frames=quat.normalize(frames))

    def with_joint(self, name, parent, offset):
        """The figure with one more joint, the last."""
        return Figure(
            (*self.names, name),
            (*self.parents, self.index(parent)),
            np.concatenate([self.offsets, [offset]]),
            np.concatenate([self.frames, [quat.IDENTITY]]),
        )

    def with_root(self, name):
        """The figure below a new root at the origin."""
        return Figure(
            (name, *self.names),
            (-1, *(parent + 1 for parent in self.parents)),
            np.concatenate([np.zeros((1, 3)), self.offsets]),
            np.concatenate([quat.IDENTITY[None], self.frames]),
        )

    def split(self, name, inner):
        """The figure with a joint in the middle of the bone that ends at another."""
        joint = self.index(name)
        parents = [p + (p >= joint) for p in self.parents]
        parents.insert(joint, parents[joint])
        parents[joint + 1] = joint
        half = 0.5 * self.offsets[joint]
        offsets = np.insert(self.offsets, joint, half, axis=0)
        offsets[joint + 1] = half
        names = (*self.names[:joint], inner, *self.names[joint:])
        frames = np.insert(self.frames, joint, quat.IDENTITY, axis=0)
        return Figure(names, tuple(parents), offsets, frames)

    def local(self):
        """Local rotations (J, 4) and translations (J, 3), m, of the rest pose."""
        above = np.concatenate([[quat.IDENTITY], self.frames[list(self.parents[1:])]])
        return quat.mul(quat.conj(above), self.frames), quat.rotate(quat.conj(above), self.offsets)


def figure_of(skeleton, bones):
    """The figure of a skeleton with bones (J, 3), m, that stands on the floor by no joint."""
    offsets = bones.copy()
    offsets[0] = 0.0
    frames = np.tile(quat.IDENTITY, (len(bones), 1))
    return Figure(skeleton.names, skeleton.parents, offsets, frames)


def write_glb(path, figure, **more):
    """Write a figure as GLB, below a node in centimetres as from other tools."""
    turns, places = figure.local()
    nodes = [
        {
            "name": name,
            "rotation": turns[joint][[1, 2, 3, 0]].tolist(),
            "translation": (100.0 * places[joint]).tolist(),
            "children": [c for c, parent in enumerate(figure.parents) if parent == joint],
        }
        for joint, name in enumerate(figure.names)
    ]
    nodes = [{k: v for k, v in node.items() if v != []} for node in nodes]
    nodes.append({"name": "Armature", "scale": [0.01] * 3, "children": [0]})
    facts = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [len(nodes) - 1]}],
        "nodes": nodes,
        "skins": [{"joints": list(range(len(figure.names)))}],
        **more,
    }
    text = json.dumps(facts).encode()
    text += b" " * (-len(text) % 4)
    chunk = struct.pack("<II", len(text), 0x4E4F534A) + text
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk)
    return path


def write_usd(path, figure, unit=1.0, up="y", skeletons=1):
    """Write a figure as USD, with bind and rest transforms, in a unit and axes."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z if up == "z" else UsdGeom.Tokens.y)
    turn = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(np.radians(90.0)))
    basis = turn if up == "z" else quat.IDENTITY
    frames = quat.mul(basis, figure.frames)
    own = replace(figure, frames=frames, offsets=quat.rotate(basis, figure.offsets) / unit)
    turns, places = own.local()
    world = own.offsets.copy()
    for joint, parent in enumerate(own.parents[1:], start=1):
        world[joint] += world[parent]
    for index in range(skeletons):
        UsdSkel.Root.Define(stage, f"/Character{index}")
        skeleton = UsdSkel.Skeleton.Define(stage, f"/Character{index}/Skel")
        tokens = []
        for name, parent in zip(own.names, own.parents, strict=True):
            tokens.append(f"{tokens[parent]}/{name}" if parent >= 0 else name)
        skeleton.CreateJointsAttr(tokens)
        skeleton.CreateRestTransformsAttr(_matrices(turns, places))
        skeleton.CreateBindTransformsAttr(_matrices(frames, world))
    stage.GetRootLayer().Save()
    return path


def _matrices(turns, places):
    found = np.zeros((len(turns), 4, 4))
    found[:, :3, :3] = quat.to_matrix(turns).swapaxes(1, 2)
    found[:, 3, :3], found[:, 3, 3] = places, 1.0
    return Vt.Matrix4dArray.FromNumpy(found)
