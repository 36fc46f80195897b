"""Extents and levels of detail of a crowd, written after all its motions are computed.

They are written as opinions, so that they may be in a layer of their own.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Sdf

from posefield.common.units import Floats
from posefield.encode.usd_crowd import crowd_extent, crowd_scene
from posefield.encode.usd_crowd.crowd_motions import MotionSummary
from posefield.encode.usd_layers import prim_specs
from posefield.encode.usd_layers.prim_specs import ValueTypes
from posefield.motion.crowd_clip import CrowdClip

LEVEL_ATTRIBUTE = "posefield:level"
"""Level of detail of a motion's frames, with a time sample at each change."""


def add_to_references(made: Any, crowd: CrowdClip, notes: Sequence[MotionSummary]) -> None:
    """Add extents to a crowd of references to one prototype, and levels to its motions."""
    _placed_boxes(made, crowd, notes)
    every = _enlarged_float32([note.box for note in notes])
    with Sdf.ChangeBlock():
        for path in (crowd_scene.PROTOTYPE, crowd_scene.PROTOTYPE.AppendChild("Body")):
            _set_extent(made, path, every)
        for index, note in enumerate(notes):
            _set_levels(made, crowd_scene.MOTIONS.AppendChild(crowd_scene.motion_name(index)), note)


def add_to_flat(made: Any, crowd: CrowdClip, notes: Sequence[MotionSummary]) -> None:
    """Add extents and levels to a crowd in which each character has its own body and motion."""
    _placed_boxes(made, crowd, notes)
    for some in crowd_scene.character_blocks(crowd):
        with Sdf.ChangeBlock():
            for index, played in zip(some, crowd.motion[some], strict=True):
                path = crowd_scene.character_path(index)
                _set_extent(made, path.AppendChild("Body"), notes[played].box)
                _set_levels(
                    made, path.AppendChild(crowd_scene.character_name(index)), notes[played]
                )


def _placed_boxes(made: Any, crowd: CrowdClip, notes: Sequence[MotionSummary]) -> None:
    own = np.array([notes[played].box for played in crowd.motion])
    for some in crowd_scene.character_blocks(crowd):
        with Sdf.ChangeBlock():
            for index in some:
                _set_extent(made, crowd_scene.character_path(index), own[index])
    whole = prim_specs.float3_array(crowd_extent.placed_box(crowd.placement, own))
    for path in (crowd_scene.ROOT, crowd_scene.CHARACTERS):
        _attribute(made, path.AppendProperty("extentsHint"), ValueTypes.Float3Array).default = whole


def _enlarged_float32(boxes: Sequence[Floats]) -> Floats:
    corners = np.array(boxes)
    return np.stack([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])


def _set_extent(made: Any, prim: Any, box: Floats) -> None:
    _attribute(
        made, prim.AppendProperty("extent"), ValueTypes.Float3Array
    ).default = prim_specs.float3_array(box)


def _set_levels(made: Any, prim: Any, note: MotionSummary) -> None:
    path = prim.AppendProperty(LEVEL_ATTRIBUTE)
    _attribute(made, path, ValueTypes.Int).custom = True
    for frame, level in note.levels.items():
        made.SetTimeSample(path, frame, level)


def _attribute(made: Any, path: Any, kind: Any) -> Any:
    found = made.GetAttributeAtPath(path)
    return found or Sdf.CreatePrimAttributeInLayer(made, path, kind)
