"""A crowd as many layers: an entry, the character, one of each motion, and what sums them up.

Motions are written as they are made, in a fraction of the time of a single layer. The summary is
a sublayer of the entry, so that the entry can be written before any motion has been made.
"""

from collections.abc import Iterator
from typing import Any

from pxr import Sdf

from service.encode import character, layers, specs, usdz
from service.encode.crowd import motions, scene, summary
from service.encode.usdz import Member
from service.motion.crowd import CrowdClip

FOLDER, CHARACTER, SUMMARY = "crowd_clips", "character.usdc", "summary.usdc"


def entry(crowd: CrowdClip, instanced: bool, folder: str) -> bytes:
    """The layer that is opened; it finds the others in a folder beside it."""
    made = scene.new(crowd)
    root = made.GetPrimAtPath(scene.ROOT)
    made.subLayerPaths.append(f"./{folder}/{SUMMARY}")
    with Sdf.ChangeBlock():
        prototype = specs.prim(root, scene.PROTOTYPE.name, "SkelRoot")
        prototype.specifier, prototype.kind = Sdf.SpecifierClass, "component"
        scene.payload(prototype, f"./{folder}/{CHARACTER}")
        group = specs.prim(root, scene.MOTIONS.name, "Scope")
        for name in map(scene.motion, range(motions.count(crowd))):
            scene.payload(specs.prim(group, name, "SkelAnimation"), f"./{folder}/{name}.usdc")
        scene.referring(made, crowd, instanced)
    return layers.crate(made)


def parts(crowd: CrowdClip) -> Iterator[tuple[str, bytes]]:
    """Name and content of each other layer, one at a time."""
    rig = character.rig(crowd.skeleton, crowd.skeleton.offsets)
    standing = _layer("Character", crowd)
    character.root(standing, "Character", rig, rig.box)
    yield CHARACTER, layers.crate(standing)
    write, notes = motions.writer(rig.paths, crowd.frames, crowd.rate), []
    for index, motion in enumerate(motions.each(crowd, rig)):
        notes.append(motion.note)
        yield f"{scene.motion(index)}.usdc", write(motion.samples)
    last = _layer(scene.ROOT.name, crowd)
    with Sdf.ChangeBlock():
        summary.referring(last, crowd, notes)
    yield SUMMARY, layers.crate(last)


def members(crowd: CrowdClip, instanced: bool) -> Iterator[Member]:
    """The same layers as members of an archive, the entry first."""
    yield usdz.whole("crowd.usdc", entry(crowd, instanced, FOLDER))
    for name, content in parts(crowd):
        yield usdz.whole(f"{FOLDER}/{name}", content)


def _layer(default: str, crowd: CrowdClip) -> Any:
    made = Sdf.Layer.CreateAnonymous("part.usda")
    layers.head(made, default, crowd.frames, crowd.rate)
    return made
