"""USD stage of one character and many clips, each clip in a layer of its own.

    /Character                  SkelRoot, the default prim: in the model's rest pose
      Skel                      bound to the first of the clips
      Body
      Clips
        NAME                    SkelAnimation, by a payload in NAME's layer

Readers load payloads on demand: pxr opens a stage of 100,000 clips without them in seconds. The
prims of the clips are written as text, because usd-core takes ten times as long and 250 MB more to
create as many prims, and as long to read them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf

from posefield.common.units import Floats
from posefield.encode import character, layers
from posefield.encode.character import CharacterRig, Convention
from posefield.motion.skeleton import Skeleton

ROOT = Sdf.Path("/Character")
CLIPS = ROOT.AppendChild("Clips")
CLIPS_SCOPE = f'def Scope "{CLIPS.name}"\n    {{\n'

Corner = tuple[float, float, float]


@dataclass(frozen=True)
class LibraryEntry:
    """Clip of a library: its name, and the path of its layer relative to the stage.

    low, high: corners of a box that contains the character in all frames, m.
    """

    name: str
    file: str
    frames: int
    rate: float
    low: Corner
    high: Corner


def library_stage(
    skeleton: Skeleton,
    convention: Convention,
    rate: float,
    entries: Sequence[LibraryEntry],
    curves: Sequence[str] = (),
    has_root: bool = False,
) -> bytes:
    """Return the USD text of the stage; names of clips are made legal names of prims.

    rate: of the stage, frames a second. The stage is as long as the longest clip. curves: names of
    the clips' curves, for which the body has blend shapes. has_root: whether clips have root bones.
    """
    prims = character.legal_names(entry.name for entry in entries)
    rig = character.rig(skeleton, convention.body, has_root)
    character_layer = _character_layer(rig, convention, rate, entries)
    root = character_layer.GetPrimAtPath(ROOT)
    layers.add_blend_shapes(root, rig, curves)
    layers.prim(root, CLIPS.name, "Scope")
    for name in prims[:1]:
        layers.bind_animation(root, CLIPS.AppendChild(name))
    text: str = character_layer.ExportToString()
    head, opening, tail = text.rpartition(CLIPS_SCOPE)
    clips = "\n".join(_clip_prims(prims, entries))
    return "".join((head, opening, clips, tail)).encode()


def _character_layer(
    rig: CharacterRig, convention: Convention, rate: float, entries: Sequence[LibraryEntry]
) -> Any:
    """Return the layer of the stage with its character alone."""
    layer = Sdf.Layer.CreateAnonymous("library.usda")
    lasting = max((entry.frames - 1) / entry.rate for entry in entries) if entries else 0.0
    layers.set_layer_metadata(layer, ROOT.name, round(lasting * rate) + 1, rate, convention)
    root = layers.add_character(layer, ROOT.name, rig, convention)
    numbers = character.rest_pose_arrays(rig, convention)
    extent = _library_box(numbers["extent"], entries, convention)
    layers.set_character(root, layers.usd_values({**numbers, "extent": extent}))
    return layer


def _clip_prims(prims: Sequence[str], entries: Sequence[LibraryEntry]) -> Iterator[str]:
    for name, entry in zip(prims, entries, strict=True):
        yield (
            f'        def SkelAnimation "{name}" (\n'
            f"            prepend payload = {_asset_path(entry.file)}\n"
            "        )\n        {\n        }\n"
        )


def _asset_path(file: str) -> str:
    """Return the path of a layer beside the stage as USD text."""
    path = f"./{file}"
    return f"@@@{path}@@@" if "@" in path else f"@{path}@"


def _library_box(rest: Floats, entries: Sequence[LibraryEntry], convention: Convention) -> Floats:
    """Return the lowest and highest corner (2, 3) of the rest pose and all clips."""
    boxes = np.array([(entry.low, entry.high) for entry in entries]).reshape(-1, 2, 3)
    box = np.concatenate([rest[None], character.convert_box(convention, boxes)])
    return np.stack([box[:, 0].min(axis=0), box[:, 1].max(axis=0)]).astype(np.float32)
