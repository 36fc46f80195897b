"""Foot skate of walking characters, per stride."""

import numpy as np

from service.motion import ground, skeleton
from service.motion.card import ModelCard
from service.motion.conventions import Floats
from service.motion.crowd import Motions
from service.synthesis.walk import company, detail, march, plane, stride
from service.synthesis.walk.gait import Gait


def of(card: ModelCard, motions: Motions, rate: float) -> Floats:
    """Return the mean foot skate (M, strides), m/s, of motions cut into lengths of a mean stride.

    The ground is at the lowest height of each stride, as for captured clips. A remainder at the end
    is ignored, unless the motion is shorter than a stride. Needs a card with feet.
    """
    frames = motions.rotations.shape[1]
    length = min(round(float(np.mean(card.durations)) * rate) + 1, frames)
    bones, roots, rotations = (
        part.astype(np.float64)
        for part in (motions.bone_offsets, motions.root_position, motions.rotations)
    )
    local = skeleton.translations(bones, roots)
    joints = skeleton.positions(card.skeleton.parents, rotations, local)
    feet = joints[:, : frames // length * length, list(card.feet)]
    return ground.skate(feet.reshape(len(feet), -1, length, *feet.shape[2:]), rate)


def of_strides(gait: Gait, rate: float) -> Floats:
    """Return the foot skate (N, 1), m/s, of one stride at each captured clip's controls."""
    card = gait.session.card
    controls = np.array(card.examples)
    length = round(float(np.mean(card.durations)) * rate) + 1
    who = stride.movers(card)
    nowhere = np.zeros(len(controls))
    origin = plane.of(np.zeros((len(controls), 3)))
    held = np.repeat(controls[:, None], length, axis=1)
    plan = march.roam(gait, held, who, nowhere, (origin, nowhere), rate)
    finest = detail.constant(0, plan.phases.shape)
    return of(card, company.motions(gait.session, plan, np.arange(len(controls)), finest), rate)


def usual(gait: Gait, rate: float) -> float:
    """Return the mean foot skate of the model's strides, m/s, performers weighted equally."""
    speeds = of_strides(gait, rate)[:, 0]
    moved_by = stride.movers(gait.session.card)
    return float(np.mean([speeds[moved_by == one].mean() for one in np.unique(moved_by)]))
