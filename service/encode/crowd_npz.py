"""Crowd poses as NumPy's own archive: one stored array a column, and the facts as texts."""

import io
import zipfile
from typing import Any

import numpy as np

from service.encode import crowd_poses
from service.encode.crowd_poses import Column
from service.motion.crowd import CrowdPoses

# The first moment a zip archive can name: the bytes hang on the poses alone.
TIME = (1980, 1, 1, 0, 0, 0)
READABLE = 0o644 << 16


def npz(poses: CrowdPoses) -> bytes:
    """Archive that numpy.load opens without pickle; the same poses always give the same bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name, values in (crowd_poses.columns(poses) | _facts(poses)).items():
            with archive.open(_member(name), "w") as file:
                np.lib.format.write_array(file, values, allow_pickle=False)
    return stream.getvalue()


def _facts(poses: CrowdPoses) -> dict[str, Column]:
    return {
        "model": np.array(poses.model),
        "names": np.array(poses.skeleton.names),
        "parents": np.array(poses.skeleton.parents, dtype=np.int32),
        "units": np.array(crowd_poses.fact_texts(poses)["units"]),
        "warnings": np.array(poses.warnings, dtype=np.str_),
    }


def _member(name: str) -> zipfile.ZipInfo:
    member: Any = zipfile.ZipInfo(f"{name}.npy", TIME)
    member.create_system, member.external_attr = 3, READABLE
    return member
