"""Holds: a character stops and stays in its pose for a time, such as with a hand at a shelf.

First the motion before slows down until it stops (`come_to_rest`). Then its last pose is kept
(`hold_passage`): the body sways a little, the head may turn to a point, and one joint, such as the
hand, stays exactly where it is. The hold ends in the pose in which it began.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from posefield.common.array_shapes import Bones, Frames, RootPath, Rotations, Vector
from posefield.common.errors import InvalidField
from posefield.common.name_suggestion import did_you_mean
from posefield.feet import limbs, two_bone
from posefield.feet.limbs import Limb
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield.performance.acts import sway
from posefield.performance.acts.gaze import Looker
from posefield.performance.passages.passage import RATE, Passage, concatenate
from posefield.question import value_validation

REST_FRAMES = 16
"""Frames in which a motion comes to rest; they show the last half as many frames of it."""
RAMP = 1.0
"""Time in which sway grows and fades, s. A shorter hold sways less."""
LOOK_RAMP = 0.5
"""Time in which the gaze turns to a point and back, s."""
# Frames through which the one between two others is interpolated.
WINDOW = 4


@dataclass(frozen=True)
class Hold:
    """Question for a hold.

    seconds: how long the pose is kept. joint: name of the joint that stays where it is. look_at:
    point that the head turns to, in the frame of the passage, m. seed: of the sway.
    """

    seconds: float
    joint: str | None = None
    look_at: tuple[float, float, float] | None = None
    seed: int = 0


@dataclass(frozen=True)
class HeldBody:
    """Skeleton of a character that stays in a pose.

    bones: offsets (J, 3), m. joints: by role. facing: of the rest pose, from +z to the left, rad.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    bones: Bones
    joints: Mapping[str, int]
    facing: float = 0.0

    @cached_property
    def looker(self) -> Looker:
        """The skeleton as one that can look."""
        return Looker(self.parents, self.bones, self.joints, self.facing)


@dataclass(frozen=True)
class HeldPassage:
    """Frames of a hold. miss: angle by which the gaze stays beside its point, rad; 0 for none."""

    passage: Passage
    miss: float = 0.0


def body_of(
    skeleton: Skeleton, roles: Mapping[str, str], bones: Bones, facing: float = 0.0
) -> HeldBody:
    """Return the body of a character with joints by role, bone offsets (J, 3), m, and its facing.

    facing: of the rest pose, from +z to the left, rad.
    """
    joints = {role: skeleton.names.index(joint) for role, joint in roles.items()}
    return HeldBody(skeleton.names, skeleton.parents, bones, joints, facing)


def come_to_rest(before: Passage) -> Passage:
    """Return the passage with its end slowed down, so that it reaches its last pose at rest.

    The last frames are shown in twice their time, `REST_FRAMES` at most, with the speed of time
    1 - 3 u^2 + 2 u^3 over them, so that each joint keeps its path.
    """
    places = _slowed_places(len(before))
    if not len(places):
        return before
    begin = len(before) - 1 - len(places) // 2
    return concatenate(before.part(0, begin + 1), at_frames(before, places))


def rest_frame(frames: int, frame: int) -> int:
    """Return the frame of a slowed passage that is nearest to a frame of the original one.

    frames: number of frames of the original passage.
    """
    places = _slowed_places(frames)
    begin = frames - 1 - len(places) // 2
    if frame <= begin:
        return frame
    return begin + 1 + int(np.argmin(np.abs(places - frame)))


def _slowed_places(frames: int) -> Frames:
    """Return the fractional frames (S,) at which a passage of F frames is sampled as it slows."""
    shown = min(REST_FRAMES // 2, frames - 1)
    if not shown:
        return np.zeros(0)
    share = np.arange(1, 2 * shown + 1) / (2 * shown)
    gone = 2.0 * shown * (share - share**3 + 0.5 * share**4)
    found: Frames = frames - 1 - shown + np.minimum(gone, shown)
    return found


def hold_passage(before: Passage, asked: Hold, body: HeldBody) -> HeldPassage:
    """Return the frames in which the last pose of a passage is held, that one left out.

    The passage has come to rest (`come_to_rest`). The held joint stays where it is, and so does its
    orientation; feet are to be planned, as their contacts go on. Raises InvalidField for a time
    without a frame, a joint that no arm or leg leads to, and as `Looker.look_at` does.
    """
    count = _frames(asked)
    limb = _limb(body, asked.joint)
    rotations = np.repeat(before.rotations[-1:], count, axis=0)
    roots = np.repeat(before.roots[-1:], count, axis=0)
    rotations, roots = sway.add_sway(
        rotations, roots, body.joints, _envelope(count, RAMP) * _gain(count), RATE, asked.seed
    )
    miss = 0.0
    if asked.look_at is not None:
        gaze = body.looker.look_at(before.rotations[-1], before.roots[-1], _point(asked.look_at))
        # A head cannot turn to a point and back in no time: a short hold turns it by a part.
        share = min(1.0, 0.5 * count / RATE / LOOK_RAMP)
        turning = _envelope(count, LOOK_RAMP) * share
        rotations = gaze.add(body.parents, rotations, turning)
        miss = gaze.miss + (1.0 - share) * float(np.linalg.norm(gaze.turn))
    if limb is not None:
        rotations, roots = _keep(body, limb, before, rotations, roots)
    last = before.part(len(before) - 1, len(before))
    contacts, sigmas = (np.repeat(own, count, axis=0) for own in (last.contacts, last.sigmas))
    return HeldPassage(Passage(rotations, roots, contacts, sigmas), miss)


def at_frames(own: Passage, places: Frames) -> Passage:
    """Return a passage at fractional frames (S,), by cubics through the nearest ones."""
    size = min(WINDOW, len(own))
    first = np.clip(places.astype(int) - 1, 0, len(own) - size)
    rows = first[:, None] + np.arange(size)
    weights = _lagrange(places - first, size)
    nearest = own.rotations[rows[:, 0]]
    apart = quat.log(quat.mul(quat.conj(nearest)[:, None], own.rotations[rows]))
    turned = quat.mul(nearest, quat.exp(np.einsum("sk,skjc->sjc", weights, apart)))
    roots = np.einsum("sk,skc->sc", weights, own.roots[rows])
    before = np.clip(places.astype(int), 0, len(own) - 1)
    after = np.minimum(before + 1, len(own) - 1)
    share = places - before
    contacts = own.contacts[before] + share[:, None] * (own.contacts[after] - own.contacts[before])
    sigmas = own.sigmas[before] + share * (own.sigmas[after] - own.sigmas[before])
    return Passage(turned, roots, contacts, sigmas)


def _lagrange(places: Frames, size: int) -> np.ndarray:
    """Return the weights (S, size) of points 0, 1, ... for the polynomial through them."""
    found = np.ones((len(places), size))
    for point in range(size):
        for other in range(size):
            if other != point:
                found[:, point] *= (places - other) / (point - other)
    return found


def _frames(asked: Hold) -> int:
    seconds = value_validation.check_number("hold", asked.seconds)
    count = round(seconds * RATE)
    if count < 1:
        raise InvalidField("hold", f"{seconds:g} s, expected at least {1.0 / RATE:.3g} s")
    return count


def _point(given: tuple[float, ...]) -> Vector:
    pairs = enumerate(given)
    return np.array([value_validation.check_number(f"look_at/{axis}", own) for axis, own in pairs])


def _envelope(count: int, ramp: float) -> Frames:
    """Return a weight (F,) that grows from 0 to 1 and falls to 0 in the last frame."""
    times = np.arange(1, count + 1) / RATE
    whole = count / RATE
    share = np.clip(np.minimum(times, whole - times) / min(ramp, 0.5 * whole), 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def _gain(count: int) -> float:
    """Return the gain of the sway of a hold, whose speed is that of a long one."""
    return min(1.0, 0.5 * count / RATE / RAMP)


def _limb(body: HeldBody, name: str | None) -> Limb | None:
    """Return the limb that ends at a joint; None for no joint."""
    if name is None:
        return None
    if name not in body.names:
        known = ", ".join(body.names)
        raise InvalidField("joint", f"{name!r}{did_you_mean(name, body.names)}, expected {known}")
    found = limbs.find_kept_limb(body.parents, body.bones, body.names.index(name))
    if found is None:
        raise InvalidField("joint", f"{name!r}, expected a joint that an arm or a leg leads to")
    return found


def _keep(
    body: HeldBody, limb: Limb, before: Passage, rotations: Rotations, roots: RootPath
) -> tuple[Rotations, RootPath]:
    """Return poses (F, J, 4) and roots (F, 3), m, whose limb ends where it did.

    The root follows where the limb is too short.
    """
    last = limbs.evaluate_poses(
        body.parents, body.bones, [limb], before.rotations[-1:], before.roots[-1:]
    )
    poses = limbs.evaluate_poses(body.parents, body.bones, [limb], rotations, roots)
    apart = last.position(limb.lower) - poses.position(limb.upper)
    distance = np.linalg.norm(apart, axis=-1)
    beyond = np.maximum(distance - two_bone.firm_reach(last, limb), 0.0)
    shift = (beyond / distance)[:, None] * apart
    turns = two_bone.solve(poses, limb, apart - shift)
    # The hand keeps its orientation while the body above it sways.
    kept = quat.mul(quat.conj(poses.orientation(limb.lower)), last.orientation(limb.lower))
    found = rotations.copy()
    replace(turns, lower=quat.mul(turns.lower, kept)).apply(limb, found)
    return found, roots + shift
