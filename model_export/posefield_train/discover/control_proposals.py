"""Controls and events of a family of clips, those that predict recordings that were left out.

Candidates are the measures that recipes know: places of hands, feet, head and hips at moments of
the motion, and quantities of locomotion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.motion import measures
from posefield.motion.measures import Measure, MeasuredMotion, MeasureMoment, Quantity

FRAMES = 30
"""Frames at which clips are compared."""
# Terms of the covariance, in shares of the motions' variance, and the scale in standard deviations
# of the controls. They are those of typical trained models.
LINEAR, CURVED, CONSTANT, SAME_PERFORMER, NUGGET = 0.5, 0.5, 1.0, 0.3, 0.15
SCALE = 2.0


class RecordingPrediction:
    """Prediction of motions from measures, with one recording left out after the other.

    values (N, k): of the motions. performers, recordings: of each of them.
    """

    def __init__(
        self, values: Floats, performers: Sequence[str], recordings: Sequence[str]
    ) -> None:
        performer_names, recording_names = np.array(performers), np.array(recordings)
        self._values = values
        self._same = performer_names[:, None] == performer_names
        self._groups = [
            np.flatnonzero(recording_names == recording) for recording in sorted(set(recordings))
        ]
        self._alone = self._square([np.zeros(len(values))])

    def remaining(self, chosen: Sequence[Floats]) -> float:
        """Return the variance that is left with standardised measures (N,) over that without."""
        return self._square(chosen) / self._alone

    def residuals(self, chosen: Sequence[Floats]) -> Floats:
        """Return the values (N, k) less those that the clips of other recordings predict."""
        inverse = np.linalg.inv(self.covariance(chosen))
        weighted = inverse @ self._values
        differences = np.zeros_like(self._values)
        for indices in self._groups:
            differences[indices] = np.linalg.solve(
                inverse[np.ix_(indices, indices)], weighted[indices]
            )
        return differences

    def covariance(self, chosen: Sequence[Floats]) -> Floats:
        """Return the covariance (N, N) of the motions for standardised measures (N,)."""
        points = np.stack(chosen, axis=1)
        root = np.sqrt(5.0) * np.linalg.norm(points[:, None] - points, axis=-1) / SCALE
        curved = (1.0 + root + root**2 / 3.0) * np.exp(-root)
        total = LINEAR * points @ points.T + CURVED * curved + CONSTANT
        return np.asarray(total + SAME_PERFORMER * self._same + NUGGET * np.eye(len(points)))

    def _square(self, chosen: Sequence[Floats]) -> float:
        return float(np.square(self.residuals(chosen)).sum())


def motion_coefficients(motions: Sequence[MeasuredMotion]) -> Floats:
    """Return the motions (N, k) by coefficients of their principal components."""
    rows = []
    for motion in motions:
        positions = motion.positions
        at = np.linspace(0.0, len(positions) - 1.0, FRAMES)
        before = np.minimum(at.astype(int), len(positions) - 2)
        share = (at - before)[:, None, None]
        rows.append((positions[before] * (1.0 - share) + positions[before + 1] * share).ravel())
    values = np.array(rows) - np.mean(rows, axis=0)
    left, sizes, _ = np.linalg.svd(values, full_matrices=False)
    return np.asarray(left * sizes)


MOMENTS: tuple[MeasureMoment, ...] = ("end", "highest", "lowest", "farthest", "start")
POSITIONS: tuple[Quantity, ...] = ("height", "forward", "left")
GAIT: tuple[Quantity, ...] = ("speed", "turn", "stride_length")
"""Controls of a cycle that travels."""
NEAR_BEST = 1.15
"""Remaining variance over the least one up to which a limb's end may be that of the event; of these
it is the one that moves most."""
LEAST_GAIN = 0.03
"""Share of the remaining variance by which a further control has to lower it."""
MOST_CONTROLS = 4
ALIKE = 0.95
"""Correlation from which on two measures say the same."""
FEWEST_VALUES = 3
"""Fewest different values of a control."""


@dataclass(frozen=True)
class FamilyClips:
    """Clips of a family as measures see them.

    motions: of the clips. joints: index by role. performers, recordings: of the clips. cyclic:
    whether the last pose leads into the first.
    """

    motions: tuple[MeasuredMotion, ...]
    joints: Mapping[str, int]
    performers: tuple[str, ...]
    recordings: tuple[str, ...]
    cyclic: bool


@dataclass(frozen=True)
class ProposedControl:
    """A control. role: of the joint that is measured; None for a quantity of the whole clip."""

    quantity: Quantity
    role: str | None = None
    at: MeasureMoment | None = None


@dataclass(frozen=True)
class ControlProposal:
    """Proposed controls and event.

    event: role of its joint, and the moment; None for a family without one. remaining: share of the
    variance of left-out recordings that is left, with the first control, the first two and so on,
    by the variance without any; the controls of an event come together.
    """

    controls: tuple[ProposedControl, ...]
    event: tuple[str, MeasureMoment] | None
    remaining: tuple[float, ...]


def propose_controls(clips: FamilyClips) -> ControlProposal:
    """Return the controls that predict clips of left-out recordings best, at most MOST_CONTROLS.

    Raises ValueError for clips of one recording, which cannot be left out.
    """
    if len(set(clips.recordings)) < 2:
        raise ValueError("clips of one recording, expected two recordings or more")
    prediction = RecordingPrediction(
        motion_coefficients(clips.motions), clips.performers, clips.recordings
    )
    measured_candidates = _candidates(clips)
    values = {
        control: (measured - measured.mean()) / measured.std()
        for control, measured in measured_candidates.items()
        if len(np.unique(measured.round(4))) >= FEWEST_VALUES
    }
    event = None if clips.cyclic else _event(clips, prediction, values)
    if clips.cyclic:
        first = [ProposedControl(quantity) for quantity in GAIT]
    else:
        first = [] if event is None else [ProposedControl(axis, *event) for axis in POSITIONS]
    chosen = [candidate for candidate in first if candidate in values]
    remaining = [prediction.remaining([values[own] for own in chosen])] if chosen else []
    while len(chosen) < MOST_CONTROLS:
        best = _next(prediction, values, chosen)
        if best is None or best[0] > (remaining[-1] if remaining else 1.0) * (1.0 - LEAST_GAIN):
            break
        remaining.append(best[0])
        chosen.append(best[1])
    return ControlProposal(tuple(chosen), event, tuple(remaining))


def _candidates(clips: FamilyClips) -> dict[ProposedControl, Floats]:
    roles = ["hips", "head", *_limb_ends(clips.joints)]
    measured = {
        ProposedControl(axis, role, at): _measured(clips, Measure(axis, (clips.joints[role],), at))
        for role in roles
        if role in clips.joints
        for axis in POSITIONS
        for at in MOMENTS
        if (role, at) != ("hips", "farthest")
    }
    # Speed and turn of a motion that ends elsewhere depend on the cut: recipes refuse them.
    for quantity in GAIT if clips.cyclic else ():
        measured[ProposedControl(quantity)] = _measured(clips, Measure(quantity))
    return measured


def _limb_ends(joints: Mapping[str, int]) -> list[str]:
    roles = [
        next((side + name for name in names if side + name in joints), None)
        for side in ("left", "right")
        for names in (("Hand",), ("Toes", "Foot"))
    ]
    return [end for end in roles if end is not None]


def _measured(clips: FamilyClips, measure: Measure) -> Floats:
    return np.array([measures.evaluate(measure, motion) for motion in clips.motions])


def _event(
    clips: FamilyClips, prediction: RecordingPrediction, values: Mapping[ProposedControl, Floats]
) -> tuple[str, MeasureMoment] | None:
    """Return the limb's end that moves most among those that predict well, and its best moment."""
    by_role: dict[str, tuple[float, MeasureMoment]] = {}
    for role in _limb_ends(clips.joints):
        for at in MOMENTS:
            controls = [ProposedControl(axis, role, at) for axis in POSITIONS]
            measured = [values[control] for control in controls if control in values]
            left = prediction.remaining(measured) if measured else np.inf
            if left < by_role.get(role, (np.inf, at))[0]:
                by_role[role] = left, at
    smallest = min((left for left, _ in by_role.values()), default=np.inf)
    if smallest > 1.0 - LEAST_GAIN:
        return None
    near = [role for role, (left, _) in by_role.items() if left <= NEAR_BEST * smallest]

    def excursion(role: str) -> float:
        """Return how far a joint goes relative to the hips, from its first position, mean, m."""
        joint, hips = clips.joints[role], clips.joints["hips"]
        ways = []
        for motion in clips.motions:
            relative = motion.positions[:, joint] - motion.positions[:, hips]
            ways.append(float(np.linalg.norm(relative - relative[0], axis=1).max()))
        return float(np.mean(ways))

    role = max(near, key=excursion)
    return role, by_role[role][1]


def _next(
    prediction: RecordingPrediction,
    values: Mapping[ProposedControl, Floats],
    chosen: Sequence[ProposedControl],
) -> tuple[float, ProposedControl] | None:
    """Return the measure that lowers the remaining variance most, and what remains with it."""
    best: tuple[float, ProposedControl] | None = None
    measured = [values[standardised] for standardised in chosen]
    for candidate, standardised in values.items():
        if candidate in chosen or any(
            abs(np.mean(standardised * other)) > ALIKE for other in measured
        ):
            continue
        left = prediction.remaining([*measured, standardised])
        if best is None or left < best[0]:
            best = left, candidate
    return best
