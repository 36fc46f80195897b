"""Files of motions of a user's character in every format, and refusals of what they cannot hold.

glTF cannot refer to the skin of another file. Engines and three.js bind an animation to the user's
own file by the names of its nodes, whose local transforms it holds.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, LengthUnit, UpAxis
from posefield.encode import glb
from posefield.encode.conventions import METRES, Convention
from posefield.encode.formats import ClipEncoder
from posefield.encode.glb import GlbBuffer
from posefield.encode.user_rig import rig_stage
from posefield.encode.user_rig.rig_stage import RigStage
from posefield.motion import joint_roles, quat, root_bone
from posefield.motion.clip import Clip
from posefield.question.motion_question import BodyKind, ClipQuestion
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.results import SampledClip
from posefield.rigs.rest_joints import RestJoints
from posefield.rigs.rig import Rig

OUTER = "Armature"


def animation_glb(answer: SampledClip, rest: RestJoints) -> bytes:
    """Return the file: nodes of the joints in the rest pose of the file, and their animation.

    A node above them has the transform from the space of the root joint to the world, unless it
    is the identity.
    """
    store = GlbBuffer()
    clip = replace(
        answer.clip,
        rotations=quat.normalize(rest.file_rotations(answer.clip.rotations)),
        translations=rest.file_translations(answer.clip.translations),
        curves=None,
    )
    motion = glb.animation(store, answer, clip, rest.translations)
    return glb.container({"scene": 0, **_nodes(rest), **motion}, store)


def _nodes(rest: RestJoints) -> dict[str, Any]:
    """Return the scene and its nodes; node j is joint j."""
    nodes: list[dict[str, Any]] = [
        {"name": name, "rotation": turn, "translation": translation} | _scale(size)
        for name, turn, translation, size in zip(
            rest.names,
            rest.rotations[:, [1, 2, 3, 0]].tolist(),
            rest.translations.tolist(),
            rest.scales,
            strict=True,
        )
    ]
    for joint, parent in enumerate(rest.parents[1:], start=1):
        nodes[parent].setdefault("children", []).append(joint)
    outer = _outer_node(rest)
    root = 0
    if outer:
        root = len(nodes)
        name = joint_roles.free_name(OUTER, set(rest.names))
        nodes.append({"name": name, **outer, "children": [0]})
    return {"scenes": [{"nodes": [root]}], "nodes": nodes}


def _outer_node(rest: RestJoints) -> dict[str, Any]:
    """Return the transform above the root joint; nothing for the identity."""
    outer = rest.outer
    node = _scale(outer.scale)
    if not np.isclose(abs(outer.rotation[0]), 1.0):
        node["rotation"] = outer.rotation[[1, 2, 3, 0]].tolist()
    if not np.allclose(outer.translation, 0.0):
        node["translation"] = outer.translation.tolist()
    return node


def _scale(size: Floats) -> dict[str, Any]:
    return {} if np.allclose(size, 1.0) else {"scale": size.tolist()}


LAYERS = ("usda", "usdc", "usdz")
"""Formats of USD."""
TABLES = ("json", "npz", "arrow", "msgpack")
"""Formats of numbers, which hold the curves of the model beside the joints."""


class FileAxes(Protocol):
    """Question with the unit, up axis and body of its files."""

    @property
    def unit(self) -> LengthUnit | None:
        """Return the unit of length; None for the format's."""

    @property
    def up(self) -> UpAxis | None:
        """Return the up axis; None for the format's."""

    @property
    def body(self) -> BodyKind | None:
        """Return the body; None for the format's."""


@dataclass(frozen=True)
class RigTarget:
    """Rig for which files are written.

    file: its name. reference: path by which USD files refer to it. stage: place of its skeleton in
    a USD file; None for glTF.
    """

    rig: Rig
    file: str
    reference: str
    stage: RigStage | None

    @classmethod
    def of(cls, rig: Rig, path: Path, reference: str) -> Self:
        """Return the target of a rig in a file; UsdError if no layer can bind its skeleton."""
        if rig.format != "USD":
            return cls(rig, path.name, reference, None)
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.encode.user_rig import rig_layer

        stage = rig_layer.read_stage(path, rig.skeleton_path, rig.joint_paths)
        return cls(rig, path.name, reference, stage)

    @property
    def has_floor_root(self) -> bool:
        """Return whether the root is a joint above the hips, near the floor at rest."""
        heights = self.rig.skeleton.at_rest(self.rig.skeleton.offsets)[:, 1]
        hips = self.rig.joints["hips"]
        return hips > 0 and bool(np.ptp(heights[[0, hips]]) > 0.8 * (heights[hips] - heights.min()))

    def check(self, question: ClipQuestion | PerformanceQuestion) -> None:
        """Raise InvalidField for what no file of a user's character holds."""
        if question.names != "own":
            raise InvalidField(
                "names",
                f"{question.names!r} with a character, expected 'own': joints have the names of "
                "its file",
            )
        if question.root == "bone" and not self.rig.joints["hips"]:
            raise InvalidField(
                "root",
                f"'bone' with a character, expected one with a joint above the hips: {self.file} "
                "has none",
            )
        if isinstance(question, ClipQuestion) and question.joint_sigma:
            raise InvalidField(
                "joint_sigma",
                "true with a character, expected false: sigma is of the joints of the model",
            )

    def convention(self, form: ClipEncoder, axes: FileAxes) -> Convention:
        """Return the convention of files in a format.

        Raises InvalidField for a body, for a package, and for another unit or up axis than that of
        the character's file.
        """
        if axes.body is not None:
            raise InvalidField(
                "body",
                f"{axes.body!r} with a character, expected none given: the body is in its file",
            )
        if form.extension == "usdz" and self.stage is not None:
            raise InvalidField(
                "character",
                "a USD file with the format usdz, expected usda or usdc: a package holds all its "
                f"files, and {self.file} is referred to, not copied",
            )
        convention = form.convention(axes.unit, axes.up)
        if form.extension not in LAYERS:
            return convention
        character_axes = METRES
        if self.stage is not None:
            character_axes = Convention(self.rig.rest.metres_per_unit, self.rig.rest.up)
        if axes.unit is not None and convention.metres_per_unit != character_axes.metres_per_unit:
            raise InvalidField("unit", f"{axes.unit!r}, {self._expected(character_axes)}")
        if axes.up is not None and convention.up != character_axes.up:
            raise InvalidField("up", f"{axes.up!r}, {self._expected(character_axes)}")
        return character_axes

    def _expected(self, character_axes: Convention) -> str:
        return (
            f"expected none given: the layer has the unit, {character_axes.metres_per_unit:g} m, "
            f"and the up axis, {character_axes.up}, of the character {self.file}"
        )

    def notes(self, form: ClipEncoder, clip: Clip) -> tuple[str, ...]:
        """Return a sentence for each thing that a file in a format lacks."""
        notes = []
        if form.extension in LAYERS and self.stage is None:
            notes.append(
                f"USD cannot refer to glTF files: the layer has the skeleton of {self.file} "
                "without its skin; glb binds to the file by the names of its joints"
            )
        if form.extension in LAYERS and self.stage is not None:
            notes += self.stage.notes
        if form.extension == "glb":
            notes.append(
                "glTF cannot refer to the skin of another file: this one has the animation alone, "
                f"which binds to {self.file} by the names of its joints"
            )
        curves = clip.curves
        if curves is not None and form.has_curves and form.extension not in TABLES:
            notes.append(
                f"files of a character in {form.extension} carry no curves: {len(curves.curves)} "
                f"are left out ({', '.join(curves.names)}); {', '.join(TABLES)} have them"
            )
        return tuple(notes)

    def encode(self, form: ClipEncoder, answer: SampledClip, convention: Convention) -> bytes:
        """Return the file of a motion of the rig's skeleton, in the convention of `convention`."""
        if answer.clip.root_bone and form.extension not in TABLES:
            clip = root_bone.move_root(answer.clip, self.rig.joints["hips"])
            answer = SampledClip(clip, answer.trust)
        if form.extension in LAYERS:
            # usd-core takes 0.12 CPU seconds to import.
            from posefield.encode.usd import usd_clip
            from posefield.encode.usd_layers import layers

            layer = self._layer(answer)
            if form.extension == "usda":
                return bytes(layer.ExportToString(), "utf-8")
            binary = layers.crate_bytes(layer)
            return binary if form.extension == "usdc" else usd_clip.usdz_package(binary)
        if form.extension == "glb":
            rest = self.rig.rest if self.stage is None else rig_stage.in_metres(self.rig.rest)
            return animation_glb(answer, rest)
        return form.encode(answer, replace(convention, body="none"))

    def _layer(self, answer: SampledClip) -> Any:
        from posefield.encode.user_rig import rig_layer

        if self.stage is None:
            return rig_layer.skeleton_layer(answer, self.rig.rest)
        return rig_layer.referring_layer(answer, self.rig.rest, self.stage, self.reference)
