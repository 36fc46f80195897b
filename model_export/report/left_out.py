"""Clips as all others predict them, put back together from their leave-one-out residuals."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from model_export import hosvd
from model_export.field_bank import half_ranges
from model_export.ingest import Example
from model_export.train import Trained
from service.motion import quat, skeleton
from service.motion.conventions import Floats

# Directions of samples that carry less than this share of the first are rounding.
NOTHING = 1e-9


def spectrum(trained: Trained) -> Floats:
    """Singular values (N,) of the sample mode."""
    return np.linalg.norm(hosvd.unfold(trained.full.core, 2), axis=1)


def values(trained: Trained) -> Floats:
    """Whole motions as rows (N, N), in m² summed over joints and frames: what is kriged."""
    return trained.full.bases[2] * spectrum(trained)


def points(trained: Trained) -> Floats:
    """Controls (N, d) of the clips in half-ranges."""
    given = np.stack([example.controls for example in trained.examples])
    return half_ranges(given, given.min(axis=0), given.max(axis=0))


def performers(trained: Trained) -> npt.NDArray[np.str_]:
    """Names (N,) of who moved in each clip."""
    return np.array([example.row.performer for example in trained.examples])


def motion(trained: Trained, clip: int) -> Floats:
    """Slice (D', T) of the motion tensor that all other clips predict for one."""
    sizes = spectrum(trained)
    worth = np.where(sizes > NOTHING * sizes[0], 1.0 / np.maximum(sizes, 1e-300), 0.0)
    gap = trained.full.core @ (trained.pose.residuals[clip] * worth)
    modes, frames, _ = trained.full.bases
    return trained.tensor.values[:, :, clip] - modes @ gap @ frames.T


@dataclass(frozen=True)
class Body:
    """Positions (T, J, 3) of joints and (T, E, 3) of end sites, m."""

    joints: Floats
    tips: Floats


def body(trained: Trained, clip: int, own_motion: Floats) -> Body:
    """Where a slice (D', T) of the tensor puts the body of a clip's performer."""
    example, tensor = trained.examples[clip], trained.tensor
    rotations, root = tensor.chart.poses(tensor.mean + own_motion.T @ tensor.unwhiten.T)
    translations = np.repeat(example.offsets[None], len(root), axis=0)
    translations[:, 0] = root
    own = example.clip.skeleton
    joints, turns = skeleton.forward(own.parents, rotations, translations)
    ends = list(own.tip_joints)
    return Body(joints, joints[:, ends] + quat.rotate(turns[:, ends], own.tip_offsets))


def label(example: Example) -> str:
    """How a clip is named on the page: its file, and its line where a file has several clips."""
    return f"{example.row.place.name.removesuffix('.bvh')} (line {example.row.line})"
