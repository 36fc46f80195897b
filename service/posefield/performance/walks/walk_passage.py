"""Poses of a planned walk, and of one steady cycle."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerPoint, PointControls
from posefield.common.units import Floats
from posefield.inference.takes import TakeSettings
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.stride import RelativePoses, Strides
from posefield.performance.passages.passage import Passage
from posefield.performance.walks import standing_steps
from posefield.performance.walks.standing_pose import StandingPose
from posefield.performance.walks.standing_steps import Travel
from posefield.performance.walks.walk_segment import WalkPlan
from posefield.performance.walks.walker import Walker
from posefield.synthesis import crowd_takes, walking_feet
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.crowd_question import CharacterTakes

CYCLE_FRAMES = 60
"""Default number of frames of a steady cycle."""
# Frames between those at which sigma is computed.
SIGMA_STEP = 6


@dataclass(frozen=True)
class SynthesisSettings:
    """Level of detail and take of a walk; None for the prediction."""

    level: int = 0
    take: TakeSettings | None = None


def walk_passage(
    model: Synthesizer, plan: WalkPlan, settings: SynthesisSettings = SynthesisSettings()
) -> Passage:
    """Return the motion of a plan.

    contacts: probabilities of the contacts of `walking_feet.foot_contacts`, in their order. Phases
    are those of the plan, wrapped.
    """
    phases = plan.phases % 1.0
    done = plan.walker.strides(plan.controls, settings.level)
    posed = _poses(model, plan.walker, plan.controls, done, (phases, settings))
    places = plan.places + posed.places * np.exp(1j * plan.headings)
    walked = Passage(
        floor_plane.turn_roots(posed.rotations, plan.headings),
        floor_plane.at_height(places, posed.heights),
        _contacts(model, plan.walker, plan.controls, done, (phases, settings)),
        _sigmas(model, plan.walker, plan.controls),
        phases,
    )
    if plan.standing is None:
        return walked
    travel = Travel(plan.places, plan.headings, plan.phases)
    return standing_steps.add_standing_ends(walked, travel, plan.standing)


def cycle_passage(
    model: Synthesizer,
    walker: Walker,
    controls: Annotated[Floats, "controls"],
    frames: int = CYCLE_FRAMES,
    settings: SynthesisSettings = SynthesisSettings(),
) -> Passage:
    """Return one steady cycle at controls (d,), from phase 0, at the origin and heading along z.

    The cycle has `frames` frames, evenly in phase, whatever its duration is.
    """
    rows = np.repeat(controls[None], frames, axis=0)
    phases = np.arange(frames) / frames
    own = walker.strides(controls[None], settings.level)
    done = walker.strides(rows, settings.level)
    posed = _poses(model, walker, rows, done, (phases, settings))
    turned = phases * own.turns
    places = floor_plane.arc_displacement(phases * own.travels, turned)
    places = places + posed.places * np.exp(1j * turned)
    return Passage(
        floor_plane.turn_roots(posed.rotations, turned),
        floor_plane.at_height(places, posed.heights),
        _contacts(model, walker, rows, done, (phases, settings)),
        _sigmas(model, walker, rows),
        phases,
    )


def still(pose: StandingPose) -> Passage:
    """Return three frames of a standing pose, in the frame that travels."""
    root = floor_plane.at_height(np.array([pose.place]), np.array([pose.height]))
    return Passage(
        np.repeat(pose.rotations[None], 3, axis=0),
        np.repeat(root, 3, axis=0),
        np.ones((3, len(pose.legs))),
        np.zeros(3),
    )


def _poses(
    model: Synthesizer,
    walker: Walker,
    controls: PointControls,
    own: Strides,
    asked: tuple[PerPoint, SynthesisSettings],
) -> RelativePoses:
    """Return the poses (F) at controls (F, d), whose strides are known, and at phases (F,)."""
    phases, settings = asked
    labels, level, take = walker.labels(len(controls)), settings.level, settings.take
    if take is None:
        return stride.poses_of_strides(model.session, (controls, labels), own, phases, level)
    count = len(controls)
    takes = CharacterTakes(
        np.full(count, take.seed), np.full(count, take.variety), np.full(count, take.detail)
    )
    times = (phases * own.durations)[:, None]
    turned, path, _ = crowd_takes.pose_takes(model, takes, controls, times, labels, level)
    return stride.relative_poses(own, phases, turned, path)


def _contacts(
    model: Synthesizer,
    walker: Walker,
    controls: PointControls,
    own: Strides,
    asked: tuple[PerPoint, SynthesisSettings],
) -> Annotated[Floats, "frames feet"]:
    """Return the probabilities (F, K) of the feet's contacts; arguments as for `_poses`."""
    card = model.session.card
    feet = walking_feet.foot_contacts(card)
    if not feet:
        return np.zeros((len(controls), 0))
    labels, (phases, settings) = walker.labels(len(controls)), asked
    found = stride.contact_probabilities(
        model.session, controls, labels, phases, settings.level, own.durations
    )
    return np.clip(found[:, [card.contacts.index(own) for own in feet]], 0.0, 1.0)


def _sigmas(
    model: Synthesizer, walker: Walker, controls: PointControls
) -> Annotated[Floats, "frames"]:
    frames = len(controls)
    rows = np.unique(np.append(np.arange(0, frames, SIGMA_STEP), frames - 1))
    found = model.session.sigmas(controls[rows], walker.labels(len(rows))).astype(float)
    return np.asarray(np.interp(np.arange(frames), rows, found))
