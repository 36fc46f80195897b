"""Keyframes on an armature: one slotted action, with all keys of a curve written together.

The layered API (action, slot, layer, strip, channelbag) is the same in Blender 4.5 and 5.0.
"""

import json
from dataclasses import dataclass

import bpy
import numpy as np

from .without_blender import faults
from .without_blender.bones import Channels
from .without_blender.clips import Clip

MARK = "posefield"
"""Property of an action made by this add-on, with the clip's trust as JSON."""

LINEAR = 1
"""Blender's number of linear interpolation."""

STILL = 1e-7
"""Largest shift of a bone without a key, m."""


@dataclass(frozen=True)
class Placing:
    """Position of the keys in the scene.

    start: frame of the first. step: scene frames between keys. repeated: True for Cycles modifiers,
    before and after.
    """

    start: float
    step: float
    repeated: bool

    def frames(self, count: int):
        """Return the frames of `count` keys."""
        return self.start + self.step * np.arange(count)


def begin(armature, name: str) -> list[str]:
    """Assign a new action to an armature, keep the previous one, and return notes on it."""
    made = bpy.data.actions.new(name)
    slot = made.slots.new(id_type="OBJECT", name=armature.name)
    made.layers.new("Layer").strips.new(type="KEYFRAME")
    data = armature.animation_data_create()
    before = data.action
    data.action = made
    data.action_slot = slot
    if before is None:
        return []
    before.use_fake_user = True
    return [f"its action {before.name} was set aside, and is kept"]


def own(armature):
    """Return the armature's action; raise Fault if it was not created by this add-on."""
    data = armature.animation_data
    found = data.action if data else None
    if found is None or MARK not in found:
        name = found.name if found else "none"
        raise faults.Fault(f"the armature's action ({name}) is no imported clip: import again")
    return found


def keeps_lengths(armature) -> bool:
    """Return True if the armature kept its own bone lengths when its clip was imported."""
    return bool(json.loads(own(armature)[MARK])["keep_lengths"])


def write(armature, clip: Clip, channels: Channels, placing: Placing, keep_lengths: bool) -> None:
    """Replace all keys of the armature's action by those of a clip."""
    data = armature.animation_data
    action = data.action
    bag = action.layers[0].strips[0].channelbag(data.action_slot, ensure=True)
    curves = _Curves(bag, placing)
    for joint, name in enumerate(clip.names):
        path = f'pose.bones["{bpy.utils.escape_identifier(name)}"]'
        curves.put(name, f"{path}.rotation_quaternion", channels.turns[:, joint])
        if joint == 0:
            curves.put(name, f"{path}.location", channels.path)
        else:
            curves.hold(name, f"{path}.location", channels.shifts[joint])
    action[MARK] = json.dumps({"trust": clip.trust, "keep_lengths": keep_lengths})
    armature.update_tag()
    action.update_tag()


class _Curves:
    """Curves of a channelbag, indexed once by name."""

    def __init__(self, bag, placing: Placing) -> None:
        self._bag, self._placing = bag, placing
        self._known = {(curve.data_path, curve.array_index): curve for curve in bag.fcurves}
        self._groups = {group.name: group for group in bag.groups}

    def put(self, bone: str, path: str, values) -> None:
        """Write keys at all frames. values: (F, n), of n curves."""
        frames = self._placing.frames(len(values))
        for index, column in enumerate(values.T):
            curve = self._curve(bone, path, index)
            _key(curve, frames, column)
            _repeat(curve, self._placing.repeated, onward=path.endswith(".location"))

    def hold(self, bone: str, path: str, values) -> None:
        """Write one constant key; none for a bone without curves and a shift of at most STILL."""
        if np.abs(values).max() <= STILL and (path, 0) not in self._known:
            return
        for index, value in enumerate(values):
            curve = self._curve(bone, path, index)
            _key(curve, self._placing.frames(1), np.array([value]))

    def _curve(self, bone: str, path: str, index: int):
        if (path, index) not in self._known:
            curve = self._bag.fcurves.new(path, index=index)
            if bone not in self._groups:
                self._groups[bone] = self._bag.groups.new(bone)
            curve.group = self._groups[bone]
            self._known[path, index] = curve
        return self._known[path, index]


def _key(curve, frames, values) -> None:
    points = curve.keyframe_points
    if len(points) != len(frames):
        points.clear()
        points.add(len(frames))
        points.foreach_set("interpolation", np.full(len(frames), LINEAR, dtype=np.int32))
    pairs = np.stack([frames, values], axis=-1).astype(np.float32)
    points.foreach_set("co", pairs.ravel())
    curve.update()


def _repeat(curve, repeated: bool, onward: bool) -> None:
    """Add or remove a Cycles modifier. onward: True to continue from the last value."""
    for modifier in [each for each in curve.modifiers if each.type == "CYCLES"]:
        curve.modifiers.remove(modifier)
    if repeated:
        modifier = curve.modifiers.new("CYCLES")
        modifier.mode_before = modifier.mode_after = "REPEAT_OFFSET" if onward else "REPEAT"
