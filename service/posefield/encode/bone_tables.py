"""Tables of the bones of crowds: a row for each person and frame, as Arrow or NPZ.

Rows are grouped by person, in ascending time. They are computed and written person by person, so
that a crowd is never in memory. The table for CARLA has its axes (x ahead, y to the right, z up, a
left-handed frame) and the names of its walkers' bones.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.common.units import UP
from posefield.encode import archives, bone_motion, motion_tables
from posefield.encode import table as tables
from posefield.encode.bone_motion import BoneMotion
from posefield.encode.table import Column, Table
from posefield.motion import quat
from posefield.motion.clip import CrowdClip

CARLA_BONES = {
    "crl_hips__C": "hips",
    "crl_spine__C": "spine",
    "crl_spine01__C": "chest",
    "crl_neck__C": "neck",
    "crl_Head__C": "head",
    **{
        f"crl_{name}__{side[0].upper()}": side + role
        for side in ("left", "right")
        for name, role in (
            ("shoulder", "Shoulder"),
            ("arm", "UpperArm"),
            ("foreArm", "LowerArm"),
            ("hand", "Hand"),
            ("thigh", "UpperLeg"),
            ("leg", "LowerLeg"),
            ("foot", "Foot"),
            ("toe", "Toes"),
        )
    },
}
"""Role of each bone of CARLA's walkers."""
Columns = Callable[[BoneMotion], dict[str, Column]]


def write_arrow(crowd: CrowdClip, path: Path) -> None:
    """Write the bones of a crowd as an Arrow stream, with a record batch for each person."""
    with path.open("wb") as file:
        tables.write_arrow(_person_tables(crowd, _bone_columns, _facts(crowd)), file)


def write_npz(crowd: CrowdClip, path: Path) -> None:
    """Write the bones of a crowd as an archive of arrays.

    Raises InvalidField for arrays above 4 GB.
    """
    _write_archive(crowd, path, _bone_columns, _facts(crowd))


def write_carla(crowd: CrowdClip, path: Path, roles: Mapping[str, str]) -> None:
    """Write the bones of a crowd for CARLA's walkers. roles: of the skeleton's joints.

    Raises InvalidField for a model without a role, and arrays above 4 GB.
    """
    missing = [role for role in CARLA_BONES.values() if role not in roles]
    if missing:
        raise InvalidField("format", f"carla.npz, but the model lacks {', '.join(missing)}")
    joints = [crowd.skeleton.names.index(roles[role]) for role in CARLA_BONES.values()]
    facts = {
        "names": list(CARLA_BONES),
        "people": bone_motion.people(crowd),
        "rate": crowd.rate,
        "units": "metre, radian; left-handed, x ahead, y right, z up; bones relative to location",
    }
    _write_archive(crowd, path, lambda motion: _carla_columns(motion, joints), facts)


def _facts(crowd: CrowdClip) -> dict[str, Any]:
    units = motion_tables.UNITS | {"rotation": "unit quaternion w x y z, in the world"}
    return {
        "model": crowd.facts["model"],
        "names": list(crowd.skeleton.names),
        "parents": list(crowd.skeleton.parents),
        "people": bone_motion.people(crowd),
        "rate": crowd.rate,
        "units": units,
    }


def _bone_columns(motion: BoneMotion) -> dict[str, Column]:
    positions, orientations = motion.world()
    return {
        "positions": tables.as_float32(positions),
        "rotations": tables.as_float32(orientations),
        "velocities": tables.as_float32(bone_motion.differences(positions, motion.rate)),
        "angular_velocities": tables.as_float32(
            bone_motion.angular_velocities(orientations, motion.rate)
        ),
    }


def _carla_columns(motion: BoneMotion, joints: Sequence[int]) -> dict[str, Column]:
    """Return the place on the floor (F, 3), the heading (F,) and bones (F, B, 3) in CARLA's axes.

    In the world x is X and y is Z; of a person ahead is Z, right is -X and up is Y.
    """
    positions, orientations = motion.world()
    headings = quat.twist(motion.rotations[:, 0], UP)
    feet = motion.roots * (1.0 - UP)
    back = quat.from_axis_angle(UP, -headings)[:, None]
    bones = quat.rotate(back, positions[:, joints] - feet[:, None])
    turns = quat.mul(back, orientations[:, joints])
    return {
        "location": tables.as_float32(feet[:, [0, 2, 1]]),
        "yaw": tables.as_float32(0.5 * np.pi - headings),
        "bones": tables.as_float32(bones[..., [2, 0, 1]] * [1.0, -1.0, 1.0]),
        # Mirrored with the y axis: the other two components of the axis change their sign.
        "turns": tables.as_float32(turns[..., [0, 3, 1, 2]] * [1.0, -1.0, 1.0, -1.0]),
    }


def _person_tables(crowd: CrowdClip, columns: Columns, facts: Mapping[str, Any]) -> Iterator[Table]:
    times = bone_motion.frame_times(crowd)
    for motion in bone_motion.character_motions(crowd):
        cancellation.check()
        people = np.full(len(motion), motion.index, np.int32)
        moments = times[motion.first : motion.first + len(motion)]
        yield Table({"person": people, "time": moments, **columns(motion)}, facts)


def _write_archive(
    crowd: CrowdClip, path: Path, columns: Columns, facts: Mapping[str, Any]
) -> None:
    """Write a table as an archive, column by column in temporary files beside it."""
    first, end = bone_motion.presence(crowd).T
    rows = int((end - first).sum())
    with TemporaryDirectory(dir=path.parent) as folder:
        files: dict[str, Any] = {}
        for table in _person_tables(crowd, columns, facts):
            for name, values in table.columns.items():
                if name not in files:
                    shape = (rows, *values.shape[1:])
                    size = rows * values[:1].nbytes
                    if size > archives.BYTES:
                        raise InvalidField(
                            "output", f"{size / 1e9:.1f} GB of {name}, expected 4 GB; take arrow"
                        )
                    files[name] = (Path(folder) / f"{name}.npy").open("wb")
                    files[name].write(tables.array_header(values.dtype, shape, False))
                files[name].write(values.data)
        for file in files.values():
            file.close()
        members = [
            archives.member_of_file(f"{name}.npy", Path(folder, f"{name}.npy")) for name in files
        ]
        for name, value in facts.items():
            members.append(archives.whole(f"{name}.npy", tables.array_file(value)))
        with path.open("wb") as archive:
            archive.writelines(archives.zip_chunks(members))
