"""Crowds as many layers: an entry, the character, one for each motion, and a summary.

Motions are written as they are computed, in a fraction of the time of a single layer. The summary
is a sublayer of the entry, so that the entry can be written before any motion is computed.
"""

from collections.abc import Iterator
from typing import Any

from pxr import Sdf

from service.encode import character, character_prims, layers, specs, zip_archive
from service.encode.crowd import motions, scene, summary
from service.encode.zip_archive import Member
from service.motion.crowd import CrowdClip
from service.motion.errors import InvalidField

FOLDER, CHARACTER, SUMMARY = "crowd_clips", "character.usdc", "summary.usdc"

# Upper bounds in bytes: samples of a joint in a frame; heads of both samples, time codes and level
# of a frame; the rest of a motion's layer; a character; and the rest of the entry and the body.
SAMPLE, FRAME, LAYER, EACH, REST = 4 * (3 + 4), 40, 8_000, 2_000, 100_000


def size(crowd: CrowdClip) -> int:
    """Return an upper bound of the bytes of all layers."""
    layer = LAYER + crowd.frames * (FRAME + SAMPLE * len(crowd.skeleton))
    return REST + motions.count(crowd) * layer + len(crowd.motion) * EACH


def fits(crowd: CrowdClip) -> None:
    """Raise InvalidField if an archive of the crowd could exceed the limits of a zip."""
    taken, members = size(crowd), motions.count(crowd) + 3
    if taken > zip_archive.BYTES or members > zip_archive.MEMBERS:
        found = f"{taken / 1e9:.1f} GB in {members} layers"
        expected = f"{zip_archive.BYTES / 1e9:.1f} GB in {zip_archive.MEMBERS}"
        raise InvalidField("format", f"{found}, expected at most {expected} in a usdz; take usd")


def entry(crowd: CrowdClip, instanced: bool, folder: str) -> bytes:
    """Return the root layer, which refers to the others in a folder beside it."""
    made = scene.new(crowd, "usdc")
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
    """Yield name and content of each other layer, one at a time."""
    rig, notes = character.rig(crowd.skeleton), []
    standing = _layer("Character", crowd)
    prim = character_prims.root(standing, "Character", rig)
    character_prims.fill(prim, character_prims.values(character.at_rest(rig)))
    yield CHARACTER, layers.crate(standing)
    for index, motion in enumerate(motions.each(crowd, rig)):
        notes.append(motion.note)
        yield f"{scene.motion(index)}.usdc", motions.layer(rig, crowd.rate, motion.samples)
    last = _layer(scene.ROOT.name, crowd)
    summary.referring(last, crowd, notes)
    yield SUMMARY, layers.crate(last)


def members(crowd: CrowdClip, instanced: bool) -> Iterator[Member]:
    """Yield all layers as members of an archive, the entry first."""
    yield zip_archive.whole("crowd.usdc", entry(crowd, instanced, FOLDER))
    for name, content in parts(crowd):
        yield zip_archive.whole(f"{FOLDER}/{name}", content)


def _layer(default: str, crowd: CrowdClip) -> Any:
    made = Sdf.Layer.CreateAnonymous("part.usdc")
    layers.head(made, default, crowd.frames, crowd.rate)
    return made
