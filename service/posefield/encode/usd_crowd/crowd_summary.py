"""Extents and levels of detail of a crowd, written after all its motions are computed.

They are written as opinions, so that they may be in a layer of their own.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Sdf

from posefield.common.units import Floats
from posefield.encode.usd import prim_specs
from posefield.encode.usd.prim_specs import Type
from posefield.encode.usd_crowd import crowd_extent, crowd_scene
from posefield.encode.usd_crowd.crowd_motions import Note
from posefield.motion.crowd_clip import CrowdClip

LEVEL = "posefield:level"
"""Level of detail of a motion's frames, with a time sample at each change."""


def referring(made: Any, crowd: CrowdClip, notes: Sequence[Note]) -> None:
    """Add extents to a crowd of references to one prototype, and levels to its motions."""
    _boxes(made, crowd, notes)
    every = _round([note.box for note in notes])
    with Sdf.ChangeBlock():
        for path in (crowd_scene.PROTOTYPE, crowd_scene.PROTOTYPE.AppendChild("Body")):
            _extent(made, path, every)
        for index, note in enumerate(notes):
            _levels(made, crowd_scene.MOTIONS.AppendChild(crowd_scene.motion(index)), note)


def flat(made: Any, crowd: CrowdClip, notes: Sequence[Note]) -> None:
    """Add extents and levels to a crowd in which each character has its own body and motion."""
    _boxes(made, crowd, notes)
    for some in crowd_scene.blocks(crowd):
        with Sdf.ChangeBlock():
            for index, played in zip(some, crowd.motion[some], strict=True):
                path = crowd_scene.place_of(index)
                _extent(made, path.AppendChild("Body"), notes[played].box)
                _levels(made, path.AppendChild(crowd_scene.character(index)), notes[played])


def _boxes(made: Any, crowd: CrowdClip, notes: Sequence[Note]) -> None:
    own = np.array([notes[played].box for played in crowd.motion])
    for some in crowd_scene.blocks(crowd):
        with Sdf.ChangeBlock():
            for index in some:
                _extent(made, crowd_scene.place_of(index), own[index])
    whole = prim_specs.vectors(crowd_extent.placed(crowd.placement, own))
    for path in (crowd_scene.ROOT, crowd_scene.CHARACTERS):
        _attribute(made, path.AppendProperty("extentsHint"), Type.Float3Array).default = whole


def _round(boxes: Sequence[Floats]) -> Floats:
    corners = np.array(boxes)
    return np.stack([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])


def _extent(made: Any, prim: Any, box: Floats) -> None:
    _attribute(made, prim.AppendProperty("extent"), Type.Float3Array).default = prim_specs.vectors(
        box
    )


def _levels(made: Any, prim: Any, note: Note) -> None:
    path = prim.AppendProperty(LEVEL)
    _attribute(made, path, Type.Int).custom = True
    for frame, level in note.levels.items():
        made.SetTimeSample(path, frame, level)


def _attribute(made: Any, path: Any, kind: Any) -> Any:
    found = made.GetAttributeAtPath(path)
    return found or Sdf.CreatePrimAttributeInLayer(made, path, kind)
