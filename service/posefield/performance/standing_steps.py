"""Opening and closing steps: a walk begins and ends with its feet beside each other.

In a closing step one foot stands, and the other one swings to a place beside it. Meanwhile the root
slows down until it is at rest over both feet, and the pose is blended into the standing pose. An
opening step is a closing step backwards in time.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Frames, RootPath, Rotations
from posefield.feet import limbs
from posefield.feet.limbs import LimbPoses
from posefield.feet.stance_rows import STANDING
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import quat
from posefield.performance.passage import RATE, Passage
from posefield.performance.standing_pose import StandingPose

# Shares of a step's frames: the latest lift of its foot, and the latest landing.
LATEST_LIFT, LATEST_LANDING = 0.3, 0.9
# Time after the landing until the pose is the standing pose, s, and the shortest step, s.
SETTLING, SHORTEST = 0.2, 0.4
MOST_BESIDE = 0.03
"""Distance, m, by which feet beside each other may be ahead of their place under the root."""


@dataclass(frozen=True)
class StandingEnds:
    """Steps with which a walk begins and ends standing.

    opening, closing: numbers of their frames at the begin and at the end of the walk; 0 for none.
    """

    pose: StandingPose
    opening: int = 0
    closing: int = 0

    def part(self, frames: int, begin: int, end: int) -> "StandingEnds":
        """Return the steps that are whole in some of the frames of a walk."""
        opening = self.opening if begin == 0 and end >= self.opening else 0
        closing = self.closing if end == frames and begin <= frames - self.closing else 0
        return StandingEnds(self.pose, opening, closing)


def opening_frames(pose: StandingPose, phases: Frames) -> int:
    """Return the frames from a passing of the feet to the next double support; 0 if too few."""
    first = float(phases[0])
    return _enough(int(np.sum(phases <= first + pose.passing_at(first).after)), phases)


def closing_frames(pose: StandingPose, phases: Frames) -> int:
    """Return the frames from the last double support to the end; 0 if too few.

    The end need not be at a passing of the feet, since the scaling of strides is limited.
    """
    passing, last = pose.passing_at(float(phases[-1])), float(phases[-1])
    beyond = (last - passing.phase + 0.5) % 1.0 - 0.5
    return _enough(int(np.sum(phases >= last - beyond - passing.before)), phases)


def _enough(frames: int, phases: Frames) -> int:
    """Return a number of frames; 0 for too short a step, and for one that is not all there."""
    return frames if SHORTEST * RATE <= frames < len(phases) else 0


def add_standing_ends(
    walked: Passage,
    origins: Annotated[FloorVectors, "frames"],
    headings: Frames,
    phases: Frames,
    steps: StandingEnds,
) -> Passage:
    """Return a walk of F frames whose first and last ones are its opening and closing steps.

    origins, headings, phases: (F,), of the plan of the walk.
    """
    count = len(walked)
    if steps.opening:
        rows = slice(steps.opening - 1, None, -1)
        opening = _part(walked, rows)
        # The foot of an opening step is on the floor from the double support on: contacts are
        # likely from the landing of the heel on, and a ball that is put down then turns the knee.
        opening = replace(opening, contacts=np.zeros_like(opening.contacts))
        walked = _replaced(
            walked, rows, _close(steps.pose, opening, origins[rows], headings[rows], phases[rows])
        )
    if steps.closing:
        rows = slice(count - steps.closing, count)
        walked = _replaced(
            walked,
            rows,
            _close(steps.pose, _part(walked, rows), origins[rows], headings[rows], phases[rows]),
        )
    return walked


def _part(passage: Passage, rows: slice) -> Passage:
    return Passage(
        passage.rotations[rows], passage.roots[rows], passage.contacts[rows], passage.sigmas[rows]
    )


def _replaced(passage: Passage, rows: slice, step: Passage) -> Passage:
    rotations, roots, contacts = (
        passage.rotations.copy(),
        passage.roots.copy(),
        passage.contacts.copy(),
    )
    rotations[rows], roots[rows], contacts[rows] = step.rotations, step.roots, step.contacts
    return replace(passage, rotations=rotations, roots=roots, contacts=contacts)


@dataclass(frozen=True)
class _Course:
    """Course of a step.

    swinging: leg, by place. lift, land: frames of its swing. pose: share (F,) of the standing pose.
    swing: share (F,) of the swing.
    """

    swinging: int
    lift: int
    land: int
    pose: Frames
    swing: Frames


def _close(
    pose: StandingPose,
    walked: Passage,
    origins: Annotated[FloorVectors, "frames"],
    headings: Frames,
    phases: Frames,
) -> Passage:
    """Return a step that ends in the standing pose, from the frames of the walk on."""
    course = _course(pose, walked, float(phases[-1]))
    poses = _poses(pose, walked.rotations, walked.roots)
    balls = np.stack([poses.position(leg.tip) for leg in pose.legs], axis=1)
    towards = complex(np.exp(1j * headings[-1]))
    shift, stood = _stand(pose, complex(origins[-1]), towards, balls, course.swinging)
    count = len(origins)
    turned = np.broadcast_to(pose.rotations, (count, *pose.rotations.shape))
    standing = floor_plane.turn_roots(turned, headings)
    floor = origins + np.exp(1j * headings) * (pose.place + shift)
    standing_roots = floor_plane.at_height(floor, np.full(count, pose.height))
    rotations = quat.nlerp(walked.rotations, standing, course.pose)
    roots = quat.lerp(walked.roots, standing_roots, course.pose)
    poses = _poses(pose, rotations, roots)
    for index, leg in enumerate(pose.legs):
        share = course.swing if index == course.swinging else course.pose
        ball = quat.lerp(balls[:, index], np.broadcast_to(stood[index], roots.shape), share)
        ankle = ball - (poses.position(leg.tip) - poses.position(leg.lower))
        end = limbs.reach(poses, leg, np.zeros_like(ankle), ankle)
        turns = limbs.solve(poses, leg, end)
        rotations[:, leg.upper], rotations[:, leg.middle], rotations[:, leg.lower] = turns
    contacts = np.ones_like(walked.contacts)
    contacts[course.lift : course.land, course.swinging] = 0.0
    return replace(walked, rotations=rotations, roots=roots, contacts=contacts)


def _course(pose: StandingPose, walked: Passage, phase: float) -> _Course:
    """Return which foot swings in a step that ends at a phase, and when."""
    swinging, last = pose.passing_at(phase).swinging, len(walked) - 1
    up = np.flatnonzero(walked.contacts[:, swinging] <= STANDING)
    lift = int(up[0]) if len(up) else last
    lift = min(lift, round(LATEST_LIFT * last))
    land = min(lift + round(pose.contacts[swinging].swing * RATE), round(LATEST_LANDING * last))
    at, settled = np.arange(last + 1.0), min(land + SETTLING * RATE, last)
    return _Course(
        swinging, lift, land, _eased(at / settled), _eased((at - lift) / max(land - lift, 1))
    )


def _eased(share: Frames) -> Frames:
    """Return shares from 0 to 1 whose first and second derivatives are zero at both ends."""
    clipped = np.clip(share, 0.0, 1.0)
    eased: Frames = clipped**3 * (10.0 - 15.0 * clipped + 6.0 * clipped**2)
    return eased


def _stand(
    pose: StandingPose,
    root: complex,
    towards: complex,
    balls: Annotated[Floats, "frames 2 3"],
    swinging: int,
) -> tuple[complex, Annotated[Floats, "2 3"]]:
    """Return where a walker stands beside the foot on which the step is made.

    First the shift of the root from its place in the standing pose, in the frame that travels, then
    the balls of both feet, m. The root ends where the walk does, give or take `MOST_BESIDE` ahead
    and the sway to the standing foot. If that foot is farther ahead or behind, the other one is set
    as far to the other side, so that the root is between them. root, towards: where the walk ends,
    and its direction there.
    """
    standing_balls = root + towards * pose.balls
    foot = 1 - swinging
    stood = complex(floor_plane.project(balls[:, foot]).mean())
    off = complex((stood - standing_balls[foot]) / towards)
    forward = float(np.clip(off.real, -MOST_BESIDE, MOST_BESIDE))
    balls_on_floor = standing_balls + towards * complex(2.0 * forward - off.real, off.imag)
    balls_on_floor[foot] = stood
    return complex(forward, off.imag), floor_plane.at_height(balls_on_floor, pose.levels)


def _poses(pose: StandingPose, rotations: Rotations, roots: RootPath) -> LimbPoses:
    tips = [leg.tip for leg in pose.legs]
    return limbs.evaluate_joints(pose.parents, pose.bones, tips, rotations, roots)
