"""Clips as all others predict them, put back together from their leave-one-out residuals."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from model_export.ingest import Example
from model_export.train import Trained
from service.motion import quat, skeleton
from service.motion.conventions import Floats


def performers(trained: Trained) -> npt.NDArray[np.str_]:
    """Names (N,) of who moved in each clip."""
    return np.array([example.row.performer for example in trained.examples])


def motion(trained: Trained, clip: int) -> Floats:
    """Slice (D', T) of the motion tensor that all other clips predict for one."""
    gap = trained.full.slices(trained.pose.residuals[[clip]])[:, :, 0]
    return trained.tensor.values[:, :, clip] - gap


@dataclass(frozen=True)
class Body:
    """Positions (T, J, 3) of joints and (T, E, 3) of end sites, m."""

    joints: Floats
    tips: Floats


def body(trained: Trained, clip: int, own_motion: Floats) -> Body:
    """Where a slice (D', T) of the tensor puts the body of a clip's performer."""
    example, tensor = trained.examples[clip], trained.tensor
    rotations, root = tensor.chart.poses(tensor.numbers(own_motion[:, :, None])[0])
    translations = skeleton.translations(example.offsets, root)
    own = example.clip.skeleton
    joints, turns = skeleton.forward(own.parents, rotations, translations)
    ends = list(own.tip_joints)
    return Body(joints, joints[:, ends] + quat.rotate(turns[:, ends], own.tip_offsets))


def label(example: Example) -> str:
    """How a clip is named on the page: its file, and its line where a file has several clips."""
    return f"{example.row.place.name.removesuffix('.bvh')} (line {example.row.line})"
