"""What a cycle does not come back to: where the root has got to, and where it heads.

The last pose of a cycle leads into the first. Taken out of the root, evenly over the cycle, travel
leaves a tensor whose last frame is its first, and so it is after any truncation: a synthesised
cycle closes exactly. Travel is kriged beside it and put back at the end.
"""

from dataclasses import dataclass, replace

import numpy as np

from model_export import measured
from model_export.align import Aligned
from model_export.net import Net
from service.motion import quat, travelling
from service.motion.conventions import UP, Floats

# A quaternion q turned about the vertical by an angle a is q cos a/2 + (q TURN) sin a/2.
TURN = quat.mul(quat.about(UP, np.array(np.pi)), np.eye(4))
# A slice to the end, however long the axis is.
END = 2**31 - 1


def take_out(aligned: Aligned) -> tuple[Aligned, Floats]:
    """Clips (N) that return to where they began, and how far each got (N, 3).

    Travel is the way to the left, the way forward, m, and the change of heading, rad.
    """
    travel = measured.travel(aligned.rotations[:, :, 0], aligned.root_path)
    share = np.linspace(0.0, 1.0, aligned.rotations.shape[1])
    rotations, root_path = put_back(aligned.rotations, aligned.root_path, -travel, share)
    # All else was closed before alignment: what is left is rounding.
    rotations[:, -1], root_path[:, -1] = rotations[:, 0], root_path[:, 0]
    return replace(aligned, rotations=rotations, root_path=root_path), travel


def put_back(
    rotations: Floats, root_path: Floats, travel: Floats, share: Floats
) -> tuple[Floats, Floats]:
    """Rotations (B, S, J, 4) and root path (B, S, 3) that go their way (B, 3).

    share (..., S): how much of the way each frame has behind it.
    """
    return travelling.put_back(rotations, root_path, share[..., None] * travel[:, None])


def spread(residuals: Floats) -> Floats:
    """Mean squared distance (N,), m², that errors of travel (N, 3) put all joints at.

    An error grows evenly from nothing: its square is a third of its end's on average. That of the
    heading turns the body about the root, which moves its joints by far less, and is left out.
    """
    return np.sum(np.square(residuals[:, :2]), axis=1) / 3.0


@dataclass(frozen=True)
class Travel:
    """Travel of a cycle of so many canonical frames."""

    frames: int

    def numpy(
        self, rotations: Floats, root: Floats, travel: Floats, place: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Rotations (B, S, J, 4) and root positions (B, S, 3) with travel (B, 3) put back, and how
        much of it (B, S, 3) that is.

        place (B, S): canonical frames.
        """
        share = place / (self.frames - 1)
        return *put_back(rotations, root, travel, share), share[..., None] * travel[:, None]

    def onnx(
        self, net: Net, rotations: str, root: str, travel: str, place: str
    ) -> tuple[str, str, str]:
        """The same in a graph; canonical frames are (B, S, 1) there."""
        share = net("Mul", place, net.number(1.0 / (self.frames - 1)))
        gone = net("Mul", share, net("Unsqueeze", travel, net.indices(1)))
        axes = np.vstack([np.eye(3)[[0, 2]], np.zeros(3)])
        moved = net("Add", root, net("MatMul", gone, net.weights("travel_axes", axes)))
        # Half the angle, with axes for the root's four numbers: (B, S, 1, 1).
        angle = net("Slice", gone, net.indices(2), net.indices(3), net.indices(2))
        half = net("Unsqueeze", net("Mul", angle, net.number(0.5)), net.indices(3))
        row, shape = net.padded(half), net("Shape", half)
        cosine, sine = (net.unpadded(net(turn, row), shape) for turn in ("Cos", "Sin"))
        joints = net.indices(2)
        own = net("Slice", rotations, net.indices(0), net.indices(1), joints)
        others = net("Slice", rotations, net.indices(1), net.indices(END), joints)
        across = net("MatMul", own, net.weights("travel_quarter", TURN))
        turned = net("Add", net("Mul", own, cosine), net("Mul", across, sine))
        return net("Concat", turned, others, axis=2), moved, gone
