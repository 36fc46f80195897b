"""Crowd poses as NumPy's own archive: one stored array a column, and the facts as texts."""

import numpy as np

from service.encode import arrays, crowd_poses
from service.encode.crowd_poses import Column
from service.motion.crowd import CrowdPoses


def npz(poses: CrowdPoses) -> bytes:
    """Archive that numpy.load opens without pickle; the same poses always give the same bytes."""
    return arrays.archive(crowd_poses.columns(poses) | _facts(poses))


def _facts(poses: CrowdPoses) -> dict[str, Column]:
    return {
        "model": np.array(poses.model),
        "names": np.array(poses.skeleton.names),
        "parents": np.array(poses.skeleton.parents, dtype=np.int32),
        "units": np.array(crowd_poses.fact_texts(poses)["units"]),
        "warnings": np.array(poses.warnings, dtype=np.str_),
    }
