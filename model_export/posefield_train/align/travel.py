"""Travel of a cycle: displacement and change of heading from its first to its last frame.

The last pose of a cycle leads into the first. Travel is removed from the root evenly over the
cycle, so the first and last frame of the tensor are equal, also after truncation, and a synthesized
cycle closes exactly. Travel has its own kriging model and is added back at the end.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import (
    UP,
    ClipFrames,
    ClipPaths,
    ClipRotations,
    ClipTravel,
    Floats,
    PerClip,
)
from posefield.model_file.model_card import ROW_VALUES
from posefield.motion import quat, skeleton
from posefield_train.align.time_alignment import AlignedClips
from posefield_train.onnx_graph import GraphBuilder
from posefield_train.source import measured_controls

# A quaternion q turned about the vertical by an angle a is q cos a/2 + (q TURN) sin a/2.
HALF_TURN = quat.mul(quat.from_axis_angle(UP, np.array(np.pi)), np.eye(4))


def remove_travel(aligned: AlignedClips) -> tuple[AlignedClips, ClipTravel]:
    """Return clips (N) with their travel removed, and the travel (N, 3).

    Its components are left and forward, m, and the change of heading, rad.
    """
    travel = measured_controls.travel(aligned.rotations[:, :, 0], aligned.root_path)
    share = np.linspace(0.0, 1.0, aligned.rotations.shape[1])
    rotations, root_path = put_back(aligned.rotations, aligned.root_path, -travel, share)
    # The cycles were closed before alignment; remove the rounding error.
    rotations[:, -1], root_path[:, -1] = rotations[:, 0], root_path[:, 0]
    return replace(aligned, rotations=rotations, root_path=root_path), travel


def put_back(
    rotations: ClipRotations,
    root_path: ClipPaths,
    travel: ClipTravel,
    share: Annotated[Floats, "... frames"],
) -> tuple[ClipRotations, ClipPaths]:
    """Return rotations (B, S, J, 4) and root path (B, S, 3) with travel (B, 3) added.

    share: (..., S), share of the travel completed at each frame.
    """
    return skeleton.add_travel(rotations, root_path, share[..., None] * travel[:, None])


def mean_squared_distance(residuals: ClipTravel) -> PerClip:
    """Return the mean squared distance (N,), m², of all joints due to travel errors (N, 3).

    The error grows linearly from zero, so its mean square is a third of the square at the end.
    Errors of the heading move the joints by far less and are ignored.
    """
    return np.sum(np.square(residuals[:, :2]), axis=1) / 3.0


@dataclass(frozen=True)
class Travel:
    """Travel of a cycle. frames: number of canonical frames. joints: of the skeleton."""

    frames: int
    joints: int

    def numpy(
        self, rotations: ClipRotations, root: ClipPaths, travel: ClipTravel, frames: ClipFrames
    ) -> tuple[ClipRotations, ClipPaths, ClipPaths]:
        """Return rotations (B, S, J, 4) and root positions (B, S, 3) with travel (B, 3) added.

        The third value is the travel completed (B, S, 3). frames: canonical frames (B, S).
        """
        share = frames / (self.frames - 1)
        return *put_back(rotations, root, travel, share), share[..., None] * travel[:, None]

    def onnx(
        self, net: GraphBuilder, planes: str, root: str, travel: str, frames: str
    ) -> tuple[str, str, str]:
        """Build `numpy` in a graph with poses as rows P = B S.

        planes: rotations (J, 4, P), poses innermost. root: (P, 3). travel: (B, 3). frames:
        canonical frames (B, S). The travel completed is (P, 3).
        """
        share = net("Mul", frames, net.number(1.0 / (self.frames - 1)))
        steps, axis = net("Unsqueeze", share, net.indices(2)), net.indices(1)
        gone = net("Mul", steps, net("Unsqueeze", travel, axis))
        rows = net.rename_value(ROW_VALUES["travel"], net("Reshape", gone, net.indices(-1, 3)))
        axes = np.vstack([np.eye(3)[[0, 2]], np.zeros(3)])
        moved_root = net("Gemm", rows, net.weights("travel_axes", axes), root)
        angle = net("Gather", rows, net.weights("travel_turn", np.array(2)), axis=1)
        half = net.padded(net("Mul", angle, net.number(0.5)))
        cosine, sine = (net.unpadded(net(turn, half)) for turn in ("Cos", "Sin"))
        sizes = net.indices(1, self.joints - 1)
        root_planes, *joint_planes = (
            net.multi_output("Split", 2, planes, sizes, axis=0) if self.joints > 1 else [planes]
        )
        across = net("MatMul", net.weights("travel_quarter", HALF_TURN.T), root_planes)
        turned = net("Add", net("Mul", root_planes, cosine), net("Mul", across, sine))
        return net("Concat", turned, *joint_planes, axis=0), moved_root, rows
