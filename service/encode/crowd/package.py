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
from service.motion.errors import InvalidField

FOLDER, CHARACTER, SUMMARY = "crowd_clips", "character.usdc", "summary.usdc"

# Bytes that layers take at most: two arrays of samples a joint and frame; their heads, time codes
# and level; what a motion's layer has besides; what a character takes; and entry and body.
SAMPLE, FRAME, LAYER, EACH, REST = 4 * (3 + 4), 40, 8_000, 2_000, 100_000


def size(crowd: CrowdClip) -> int:
    """Bytes that all layers take together at most."""
    layer = LAYER + crowd.frames * (FRAME + SAMPLE * len(crowd.skeleton))
    return REST + motions.count(crowd) * layer + len(crowd.motion) * EACH


def fits(crowd: CrowdClip) -> None:
    """Raise InvalidField where an archive of the crowd could become larger than any may be."""
    taken, members = size(crowd), motions.count(crowd) + 3
    if taken > usdz.BYTES or members > usdz.MEMBERS:
        found = f"{taken / 1e9:.1f} GB in {members} layers"
        expected = f"{usdz.BYTES / 1e9:.1f} GB in {usdz.MEMBERS}"
        raise InvalidField("format", f"{found}, expected at most {expected} in a usdz; take usd")


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
    rig, notes = character.rig(crowd.skeleton), []
    standing = _layer("Character", crowd)
    character.fill(character.root(standing, "Character", rig), character.at_rest(rig))
    yield CHARACTER, layers.crate(standing)
    for index, motion in enumerate(motions.each(crowd, rig)):
        notes.append(motion.note)
        yield f"{scene.motion(index)}.usdc", motions.layer(rig, crowd.rate, motion.samples)
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
