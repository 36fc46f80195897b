"""Acclaim files for tests: a small arm, and the files of any clip."""

import numpy as np

from posefield.motion import quat
from posefield.motion.bvh_writer import unwrap_euler

ARM_ASF = """# an arm of two bones
:version 1.10
:name arm
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   any words
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name upper
    direction 1 0 0
    length 2
    axis 0 0 90 XYZ
    dof rx rz
    limits (-90.0 90.0)
           (-90.0 90.0)
  end
  begin
    id 2
    name lower
    direction 1 0 0
    length 3
    axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root upper
    upper lower
  end
"""
ARM_AMC = """#!OML:ASF F:\\Bänd\\arm.ASF
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 0 0 0
upper 90 0
2
root 1 2 3 0 90 0
upper 0 90
"""


def files_of(clip, unit):
    """ASF and AMC texts of a clip whose joints stand where their parents' bones end.

    unit: metres of the files' unit. Raises AssertionError for a joint whose children begin apart.
    """
    joints = clip.skeleton
    ends = {}
    for joint, parent in list(enumerate(joints.parents))[1:]:
        if parent:
            ends.setdefault(parent, []).append(joints.offsets[joint])
        else:
            assert np.allclose(joints.offsets[joint], 0.0), "bones of the root begin at the root"
    for joint, offset in zip(joints.tip_joints, joints.tip_offsets, strict=True):
        ends.setdefault(joint, []).append(offset)
    lines = [ARM_ASF.partition(":bonedata")[0] + ":bonedata"]
    for joint in range(1, len(joints)):
        first, *others = ends[joint]
        assert all(np.allclose(first, other) for other in others), "one end a bone"
        x, y, z = (first / unit).tolist()
        lines += ["begin", f"name {joints.names[joint]}", f"direction {x!r} {y!r} {z!r}"]
        lines += ["length 1", "axis 0 0 0 XYZ", "dof rx ry rz", "end"]
    lines += [":hierarchy", "begin"]
    for parent in range(len(joints)):
        own = [joints.names[j] for j, other in enumerate(joints.parents) if other == parent]
        if own:
            lines.append(" ".join([joints.names[parent], *own]))
    return "\n".join([*lines, "end", ""]), motion_text(clip, unit)


def motion_text(clip, unit):
    """AMC text of a clip with three angles for every joint."""
    angles = np.rad2deg(unwrap_euler(quat.to_euler(clip.rotations, "ZYX")))[..., ::-1]
    lines = [":FULLY-SPECIFIED", ":DEGREES"]
    for frame, (places, turned) in enumerate(zip(clip.root_path / unit, angles, strict=True), 1):
        lines.append(str(frame))
        for joint, name in enumerate(clip.skeleton.names):
            values = [*places, *turned[0]] if joint == 0 else turned[joint]
            lines.append(" ".join([name, *(f"{value:.9f}" for value in values)]))
    return "\n".join([*lines, ""])
