"""Leave-one-out predictions of clips, restored from their residuals."""

from dataclasses import dataclass

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.source.ingest import Example


@dataclass(frozen=True)
class BodyMotion:
    """Positions of joints (T, J, 3) and of end sites (T, E, 3), m."""

    joints: Floats
    tips: Floats


def predicted_motion(trained: TrainedModel, clip: int) -> Floats:
    """Return the slice (D', T) of the motion tensor predicted for a clip from all others."""
    residual = trained.full.slices(trained.pose.residuals[[clip]])[:, :, 0]
    return trained.tensor.values[:, :, clip] - residual


def body_motion(trained: TrainedModel, clip: int, own_motion: Floats) -> BodyMotion:
    """Return the body of a clip's performer in a slice (D', T) of the motion tensor."""
    example, tensor = trained.examples[clip], trained.tensor
    rotations, root = tensor.chart.poses(tensor.numbers(own_motion[:, :, None])[0])
    translations = skeleton.translations(example.offsets, root)
    own = example.clip.skeleton
    joints, turns = skeleton.forward_kinematics(own.parents, rotations, translations)
    ends = list(own.tip_joints)
    return BodyMotion(joints, joints[:, ends] + quat.rotate(turns[:, ends], own.tip_offsets))


def clip_label(example: Example) -> str:
    """Return a clip's name on the page: its file, and its line in the table of clips."""
    return f"{example.row.place.name.removesuffix('.bvh')} (line {example.row.line})"
