"""Scene of a crowd: prototype, characters and their placement, motions and extents; its layers.

    /Crowd                      assembly, the default prim
      Prototype                 class, the one character that all others refer to
      Motions                   a SkelAnimation for each motion, outside of the instances
        m00000
      Characters                group
        c00000                  component: refers to the prototype, is placed, bound to a motion

USD never frees a name, so names are few and constant. Extents and levels of detail are written
after all motions are computed, as opinions, so that they may be in a layer of their own.

All characters share one body mesh, made for the model's own bones, while each has its own bone
offsets.

usd-core holds a layer's samples until it has been exported, so a crowd of one layer is in memory
once. A crowd of many layers, an entry, the character, one for each motion and a summary, is written
as its motions are computed, in a fraction of the time. The summary is a sublayer of the entry, so
that the entry can be written before any motion is computed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, product
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from posefield.common import cancellation
from posefield.common.units import Floats, Indices, Singles
from posefield.encode import archives, character, crate_template, crowd_size, extent, layers
from posefield.encode.archives import ZipMember
from posefield.encode.character import METRES, CharacterRig
from posefield.encode.crate_template import LayerContent
from posefield.encode.extent import AnimationSamples
from posefield.encode.layers import WEIGHTS, Samples, ValueTypes
from posefield.encode.usd_clip import AnimationLayerBuilder
from posefield.motion import quat
from posefield.motion.clip import CrowdClip, Motions, Placement
from posefield.question.motion_question import BodyKind

CORNERS = np.array(list(product((False, True), repeat=3)))


def motion_boxes(rig: CharacterRig, samples: AnimationSamples) -> Floats:
    """Return the lowest and highest corner (M, 2, 3) of each motion in its own frame, m."""
    return extent.bounding_boxes(rig.tree, samples, rig.bounds.radii_of_others(samples.offsets))


def placed_box(placement: Placement, boxes: Floats) -> Floats:
    """Return a box (2, 3) in the world, m, around boxes (N, 2, 3) of placed characters."""
    low, high = boxes[:, 0], boxes[:, 1]
    corners = np.where(CORNERS, high[:, None], low[:, None])
    world_corners = quat.rotate(placement.turns[:, None], corners) + placement.positions[:, None]
    return extent.enlarged_box(world_corners.min(axis=(0, 1)), world_corners.max(axis=(0, 1)))


@dataclass(frozen=True)
class MotionSummary:
    """Facts of a motion that are kept after it is written.

    box (2, 3): lowest and highest corner, m. levels: level of detail by the first frame at which it
    applies.
    """

    box: Floats
    levels: dict[int, int]


def all_motions(crowd: CrowdClip, rig: CharacterRig) -> Iterator[tuple[Samples, MotionSummary]]:
    """Yield samples and summary of each motion in order; at most one batch is in memory at a time.

    Samples are translations (F, J, 3), rotations (F, J, 4), real part last, and weights of the
    curves (F, C) where the crowd has some. Raises ValueError for a number of motions other than the
    characters play, and for other shapes.
    """
    count = 0
    # The variable of a for loop would keep each batch in memory while the next is computed.
    for motion in chain.from_iterable(map(partial(_batch_motions, crowd, rig), crowd.batches)):
        count += 1
        yield motion
    if count != crowd_size.motion_count(crowd):
        raise ValueError(f"{count} motions, expected {crowd_size.motion_count(crowd)}")


def motion_layer(crowd: CrowdClip, rig: CharacterRig, samples: Samples) -> bytes:
    """Return the binary layer of one motion of a crowd."""
    builder = AnimationLayerBuilder(crowd.rate, METRES, rig.paths, crowd.curves)
    return crate_template.usdc(builder, LayerContent(samples, {}, {}))


def _batch_motions(
    crowd: CrowdClip, rig: CharacterRig, batch: Motions
) -> Iterator[tuple[Samples, MotionSummary]]:
    expected = (crowd.frames, len(crowd.skeleton), 4)
    if batch.rotations.shape[1:] != expected:
        raise ValueError(f"motions of {batch.rotations.shape[1:]}, expected {expected}")
    weights = _weights(crowd, batch)
    animation = extent.samples_of_motions(batch)
    boxes = motion_boxes(rig, animation)
    for index, (motion, box) in enumerate(zip(animation.parts(1), boxes, strict=True)):
        samples = {"translations": motion.translations, "rotations": motion.rotations}
        if weights is not None:
            samples[WEIGHTS] = weights[index]
        yield samples, MotionSummary(box, _level_changes(batch.levels[index]))


def _weights(crowd: CrowdClip, batch: Motions) -> Singles | None:
    """Return the weights (M, F, C) of the curves of a batch; None for a crowd without curves.

    Raises ValueError for other curves than the crowd names.
    """
    shape = () if batch.curves is None else batch.curves.shape
    expected = (len(batch), crowd.frames, len(crowd.curves)) if crowd.curves else ()
    if shape != expected:
        raise ValueError(f"curves of {shape}, expected {expected}")
    # USD's deduplication does not distinguish -0 from 0.
    return None if batch.curves is None else batch.curves + np.float32(0.0)


def _level_changes(levels: Indices) -> dict[int, int]:
    """Return the level by frame, for the first frame and each frame at which it changes."""
    changed = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1))
    return {int(frame): int(levels[frame]) for frame in changed}


ROOT = Sdf.Path("/Crowd")
PROTOTYPE = ROOT.AppendChild("Prototype")
MOTIONS = ROOT.AppendChild("Motions")
CHARACTERS = ROOT.AppendChild("Characters")
MODEL_SCHEMAS = ("GeomModelAPI",)
BLOCK_SIZE = 500
"""Characters that are written at a time."""


def motion_name(index: int) -> str:
    """Return the name of a motion's prim."""
    return f"m{index:05}"


def character_name(index: int) -> str:
    """Return the name of a character's prim."""
    return f"c{index:05}"


def character_path(index: int) -> Any:
    """Return the path of a character."""
    return CHARACTERS.AppendChild(character_name(index))


def new_layer(crowd: CrowdClip, form: str) -> Any:
    """Return a layer with the crowd's metadata and no character; the caller must hold it.

    form: usda or usdc, in which it will be exported. usd-core copies a layer of the other form
    before it writes it, which takes half as much memory again.
    """
    layer = Sdf.Layer.CreateAnonymous(f"crowd.{form}")
    layers.set_layer_metadata(layer, ROOT.name, crowd.frames, crowd.rate)
    layer.customLayerData = {layers.FACTS: layers.usd_dictionary(crowd.facts)}
    layers.prim(layer, ROOT.name, "Xform", MODEL_SCHEMAS).kind = "assembly"
    return layer


def characters_prim(layer: Any) -> Any:
    """Return a new prim for the characters."""
    characters = layers.prim(layer.GetPrimAtPath(ROOT), CHARACTERS.name, "Xform", MODEL_SCHEMAS)
    characters.kind = "group"
    return characters


def set_payload(prim: Any, path: str) -> None:
    """Set another layer's default prim as the payload of a prim; readers may leave it out."""
    prim.SetInfo("payload", Sdf.PayloadListOp.Create(prependedItems=[Sdf.Payload(path)]))


def add_references(layer: Any, crowd: CrowdClip, instanced: bool) -> None:
    """Add every character as a reference to the prototype, instanceable where `instanced`.

    A prim cannot be added below an instance, so each character's root is bound to its motion.
    """
    with Sdf.ChangeBlock():
        characters = characters_prim(layer)
    prototype = Sdf.ReferenceListOp.Create(prependedItems=[Sdf.Reference("", PROTOTYPE)])
    for indices in character_blocks(crowd):
        with Sdf.ChangeBlock():
            prims = [layers.prim(characters, character_name(i), "SkelRoot") for i in indices]
            for prim, motion in zip(prims, crowd.motion[indices], strict=True):
                prim.SetInfo("references", prototype)
                if instanced:
                    prim.SetInfo("instanceable", True)
                layers.add_relationship(
                    prim, "skel:animationSource", MOTIONS.AppendChild(motion_name(motion))
                )
            set_transforms(prims, crowd.placement.select(indices))
            set_presence(layer, crowd, prims, indices)


def character_blocks(crowd: CrowdClip) -> Iterator[Indices]:
    """Yield indices of characters in blocks, since a change block records changes until it ends."""
    for first in range(0, len(crowd.motion), BLOCK_SIZE):
        cancellation.check()
        yield np.arange(first, min(first + BLOCK_SIZE, len(crowd.motion)))


def set_transforms(prims: Sequence[Any], placement: Placement) -> None:
    """Set the transform of each prim to its character's placement.

    It is a matrix, since one reader does not support translations by whole numbers.
    """
    order = Vt.TokenArray(["xformOp:transform"])
    for prim, matrix in zip(prims, _matrices(placement), strict=True):
        layers.varying_attribute(prim, "xformOp:transform", ValueTypes.Matrix4d, matrix)
        layers.uniform_attribute(prim, "xformOpOrder", ValueTypes.TokenArray, order)


def set_presence(layer: Any, crowd: CrowdClip, prims: Sequence[Any], indices: Indices) -> None:
    """Name people on tracks by their ids, and hide them in the frames in which they are away."""
    if crowd.presence is None:
        return
    for prim, index in zip(prims, indices.tolist(), strict=True):
        prim.SetInfo("displayName", crowd.facts["people"][index])
        begin, end = crowd.presence[index].tolist()
        visibility = {0: begin == 0, begin: True}
        if end < crowd.frames:
            visibility[end] = False
        layers.varying_attribute(prim, "visibility", ValueTypes.Token, "inherited")
        for frame, visible in visibility.items():
            path = prim.path.AppendProperty("visibility")
            layer.SetTimeSample(path, frame, "inherited" if visible else "invisible")


def _matrices(placement: Placement) -> Any:
    """Return each character's matrix4d, for row vectors: images of the axes, then the origin."""
    matrices = np.tile(np.eye(4), (len(placement), 1, 1))
    matrices[:, :3, :3] = quat.rotate(placement.turns[:, None], np.eye(3))
    matrices[:, 3, :3] = placement.positions
    return Vt.Matrix4dArray.FromNumpy(matrices)


LEVEL_ATTRIBUTE = "posefield:level"
"""Level of detail of a motion's frames, with a time sample at each change."""


def add_to_references(layer: Any, crowd: CrowdClip, summaries: Sequence[MotionSummary]) -> None:
    """Add extents to a crowd of references to one prototype, and levels to its motions."""
    _placed_boxes(layer, crowd, summaries)
    boxes = np.array([summary.box for summary in summaries])
    box = np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    with Sdf.ChangeBlock():
        for path in (PROTOTYPE, PROTOTYPE.AppendChild("Body")):
            _set_extent(layer, path, box)
        for index, summary in enumerate(summaries):
            _set_levels(layer, MOTIONS.AppendChild(motion_name(index)), summary)


def add_to_flat(layer: Any, crowd: CrowdClip, summaries: Sequence[MotionSummary]) -> None:
    """Add extents and levels to a crowd in which each character has its own body and motion."""
    _placed_boxes(layer, crowd, summaries)
    for indices in character_blocks(crowd):
        with Sdf.ChangeBlock():
            for index, motion in zip(indices, crowd.motion[indices], strict=True):
                path = character_path(index)
                _set_extent(layer, path.AppendChild("Body"), summaries[motion].box)
                _set_levels(layer, path.AppendChild(character_name(index)), summaries[motion])


def _placed_boxes(layer: Any, crowd: CrowdClip, summaries: Sequence[MotionSummary]) -> None:
    boxes = np.array([summaries[played].box for played in crowd.motion])
    for indices in character_blocks(crowd):
        with Sdf.ChangeBlock():
            for index in indices:
                _set_extent(layer, character_path(index), boxes[index])
    crowd_box = layers.float3_array(placed_box(crowd.placement, boxes))
    for path in (ROOT, CHARACTERS):
        _attribute(
            layer, path.AppendProperty("extentsHint"), ValueTypes.Float3Array
        ).default = crowd_box


def _set_extent(layer: Any, prim: Any, box: Floats) -> None:
    _attribute(
        layer, prim.AppendProperty("extent"), ValueTypes.Float3Array
    ).default = layers.float3_array(box)


def _set_levels(layer: Any, prim: Any, summary: MotionSummary) -> None:
    path = prim.AppendProperty(LEVEL_ATTRIBUTE)
    _attribute(layer, path, ValueTypes.Int).custom = True
    for frame, level in summary.levels.items():
        layer.SetTimeSample(path, frame, level)


def _attribute(layer: Any, path: Any, kind: Any) -> Any:
    attribute = layer.GetAttributeAtPath(path)
    return attribute or Sdf.CreatePrimAttributeInLayer(layer, path, kind)


def referencing_layer(crowd: CrowdClip, form: str, instanced: bool, body: BodyKind) -> Any:
    """Return a layer in which every character refers to one prototype; the caller must hold it."""
    layer, rig = new_layer(crowd, form), character.rig(crowd.skeleton, body)
    root = layer.GetPrimAtPath(ROOT)
    prototype = layers.add_character(root, PROTOTYPE.name, rig)
    layers.add_blend_shapes(prototype, rig, crowd.curves)
    layers.set_character(prototype, layers.usd_values(character.rest_pose_arrays(rig)))
    prototype.specifier = Sdf.SpecifierClass
    group = layers.prim(root, MOTIONS.name, "Scope")
    summaries = []
    for index, (samples, summary) in enumerate(all_motions(crowd, rig)):
        name = motion_name(index)
        animation = layers.add_animation(group, name, rig.paths, crowd.curves)
        layers.set_time_samples(animation, samples)
        summaries.append(summary)
    add_references(layer, crowd, instanced)
    add_to_references(layer, crowd, summaries)
    return layer


def flat_layer(crowd: CrowdClip, form: str, body: BodyKind) -> Any:
    """Return a layer in which every character has its own data; the caller must hold it."""
    layer, rig = new_layer(crowd, form), character.rig(crowd.skeleton, body)
    _copy_prototype(layer, crowd, rig)
    summaries = []
    for index, (samples, summary) in enumerate(all_motions(crowd, rig)):
        _copy_motion(layer, crowd, index, rig, samples)
        summaries.append(summary)
    add_to_flat(layer, crowd, summaries)
    return layer


def _copy_prototype(layer: Any, crowd: CrowdClip, rig: CharacterRig) -> None:
    # Sdf.CopySpec would take a third of the time, but it adds the fields of a spec in the order of
    # their names' addresses, which differs between processes and shows in binary files.
    group, values = (
        characters_prim(layer),
        layers.usd_values(character.rest_pose_arrays(rig)),
    )
    for indices in character_blocks(crowd):
        with Sdf.ChangeBlock():
            prims = [layers.add_character(group, character_name(i), rig) for i in indices]
            for prim in prims:
                layers.add_blend_shapes(prim, rig, crowd.curves)
                layers.set_character(prim, values)
            set_transforms(prims, crowd.placement.select(indices))
            set_presence(layer, crowd, prims, indices)


def _copy_motion(
    layer: Any, crowd: CrowdClip, played: int, rig: CharacterRig, samples: Samples
) -> None:
    """Give each character that plays a motion, of an index, a copy of it.

    The copy has the character's name: some readers identify an animation by the name of its prim
    alone.
    """
    first = None
    for index in np.flatnonzero(crowd.motion == played).tolist():
        cancellation.check()
        root = layer.GetPrimAtPath(character_path(index))
        skel_animation = layers.add_animation(root, root.name, rig.paths, crowd.curves)
        if first is None:
            layers.set_time_samples(skel_animation, samples)
            first = skel_animation.path
        else:
            # Each spec lacks at most one field, so the order of copying does not matter.
            Sdf.CopySpec(layer, first, layer, skel_animation.path)
        layers.bind_animation(root, skel_animation.path)


LAYER_FOLDER, CHARACTER_FILE, SUMMARY_FILE = "crowd_clips", "character.usdc", "summary.usdc"


def root_layer(crowd: CrowdClip, instanced: bool, folder: str) -> bytes:
    """Return the root layer, which refers to the others in a folder beside it."""
    layer = new_layer(crowd, "usdc")
    root = layer.GetPrimAtPath(ROOT)
    layer.subLayerPaths.append(f"./{folder}/{SUMMARY_FILE}")
    with Sdf.ChangeBlock():
        prototype = layers.prim(root, PROTOTYPE.name, "SkelRoot")
        prototype.specifier, prototype.kind = Sdf.SpecifierClass, "component"
        set_payload(prototype, f"./{folder}/{CHARACTER_FILE}")
        group = layers.prim(root, MOTIONS.name, "Scope")
        for name in map(motion_name, range(crowd_size.motion_count(crowd))):
            set_payload(layers.prim(group, name, "SkelAnimation"), f"./{folder}/{name}.usdc")
    add_references(layer, crowd, instanced)
    return layers.crate_bytes(layer)


def referenced_layers(crowd: CrowdClip, body: BodyKind) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each other layer, one at a time."""
    rig, summaries = character.rig(crowd.skeleton, body), list[MotionSummary]()
    standing = _part_layer("Character", crowd)
    prim = layers.add_character(standing, "Character", rig)
    layers.add_blend_shapes(prim, rig, crowd.curves)
    layers.set_character(prim, layers.usd_values(character.rest_pose_arrays(rig)))
    yield CHARACTER_FILE, layers.crate_bytes(standing)
    for index, (samples, summary) in enumerate(all_motions(crowd, rig)):
        summaries.append(summary)
        yield (
            f"{motion_name(index)}.usdc",
            motion_layer(crowd, rig, samples),
        )
    last = _part_layer(ROOT.name, crowd)
    add_to_references(last, crowd, summaries)
    yield SUMMARY_FILE, layers.crate_bytes(last)


def members(crowd: CrowdClip, instanced: bool, body: BodyKind) -> Iterator[ZipMember]:
    """Yield all layers as members of an archive, the entry first."""
    yield archives.whole("crowd.usdc", root_layer(crowd, instanced, LAYER_FOLDER))
    for name, content in referenced_layers(crowd, body):
        yield archives.whole(f"{LAYER_FOLDER}/{name}", content)


def _part_layer(default: str, crowd: CrowdClip) -> Any:
    layer = Sdf.Layer.CreateAnonymous("part.usdc")
    layers.set_layer_metadata(layer, default, crowd.frames, crowd.rate)
    return layer
