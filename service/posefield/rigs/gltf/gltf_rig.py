"""Joints at rest of the one skeleton of a glTF file."""

from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from posefield.common.errors import MotionFileError
from posefield.motion import quat
from posefield.rigs.gltf import gltf_document, gltf_skeleton
from posefield.rigs.gltf.gltf_document import GltfDocument
from posefield.rigs.gltf.gltf_skeleton import GltfJoints
from posefield.rigs.joints.rest_joints import OuterTransform, RestJoints

MAX_BYTES = 1_000_000_000
"""Limit of a file or buffer."""


@dataclass(frozen=True)
class GltfRig:
    """Joints of a glTF file. nodes: of the joints. skins: of the file."""

    rest: RestJoints
    nodes: tuple[int, ...]
    skins: tuple[int, ...]
    notes: tuple[str, ...]


def read(path: Path, source: str) -> GltfRig:
    """Return the joints of the skins of a .glb or .gltf file.

    source: name of the file in messages. Raises MotionFileError for a file without a skin, with
    several skeletons, and for animated nodes above the skeleton or animated scales.
    """

    def beside(name: str) -> bytes:
        parts = PurePosixPath(name).parts
        if not parts or parts[0] == "/" or ".." in parts:
            raise MotionFileError(source, f"refers to {name!r}, expected a path below its folder")
        return _content(path.parent / name)

    document = gltf_document.load(_content(path), source, beside)
    if not document.parts.skins:
        raise document.error("found no skin, expected a character whose mesh is bound to joints")
    joints = gltf_skeleton.joints_of(document, ())
    _refuse_animated(document, joints)
    local = [gltf_skeleton.node_transform(document, node) for node in joints.nodes]
    outer = OuterTransform(quat.IDENTITY, np.zeros(3), np.ones(3))
    for node in reversed(joints.outer):
        own = gltf_skeleton.node_transform(document, node)
        outer = outer.inside(OuterTransform(own.rotation, own.translation, own.scale))
    turns = joints.rest_rotations.copy()
    # The reader gives the first joint's rotation in the world.
    turns[0] = quat.mul(quat.conj(outer.rotation), turns[0])
    rest = RestJoints(
        source,
        joints.names,
        joints.parents,
        turns,
        np.stack([own.translation for own in local]),
        np.stack([own.scale for own in local]),
        outer,
        1.0,
        "y",
    )
    return GltfRig(rest, joints.nodes, tuple(range(len(document.parts.skins))), joints.notes)


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise MotionFileError(path, f"cannot be read: {fault.strerror}") from fault
    if len(content) > MAX_BYTES:
        raise MotionFileError(path, f"found more than {MAX_BYTES} bytes, expected at most these")
    return content


def _refuse_animated(document: GltfDocument, joints: GltfJoints) -> None:
    """Raise MotionFileError for curves that would remain beside the new motion.

    Curves of rotations and translations of joints are replaced.
    """
    for animation in document.parts.animations:
        for channel in animation.channels:
            node, part = channel.target.node, channel.target.path
            outer = node in joints.outer and part != "weights"
            if outer or (node in joints.nodes and part == "scale"):
                name = document.parts.nodes[node].name or node
                raise document.error(
                    f"animation {animation.name!r} changes the {part} of {name!r}, expected none "
                    "above the skeleton and no animated scale: export the character alone"
                )
