"""What a cyclic model can walk: speeds and rates of turning to controls, and how far they go.

Names and units of controls are the recipe's. What they mean is asked of the model: how fast and
turning how fast its own clips go.
"""

from dataclasses import dataclass

import numpy as np

from service.motion.conventions import Floats, Indices
from service.motion.errors import InvalidField
from service.synthesis.session import Session
from service.synthesis.walk import region, stride
from service.synthesis.walk.region import Region

# Slower than this nothing travels, and speeds nearer than this are one, m/s.
STILL = 0.05
# Rounds of correcting what is asked by what came of it.
ROUNDS = 3


@dataclass(frozen=True)
class Gait:
    """A model's way of walking.

    rates (N, 2): speed, m/s, and rate of turning, rad/s, of each captured clip, as the model
    walks it. slopes (3, d): regression of controls on 1 and rates. manners (p + 1, d): what each
    performer does otherwise, and nobody in particular at the end. region: of the rates, with
    straight on at all their speeds.
    """

    session: Session
    rates: Floats
    slopes: Floats
    manners: Floats
    region: Region

    def typical(self, speeds: Floats, turning: Floats, who: Indices) -> Floats:
        """Controls (K, d) that are usual at speeds (K,), m/s, and rates of turning (K,), rad/s, for
        performers (K,) by their place on the card, or -1 for nobody in particular.

        The conditional mean over the captured clips by linear regression, so that a control which
        speed and turning leave open, such as the length of a stride, is as clips have it there.
        """
        return _design(speeds, turning) @ self.slopes + self.manners[who]

    def controls(self, speeds: Floats, turning: Floats, who: Indices) -> Floats:
        """The same, moved along the regression until the model does what was wanted."""
        labels = stride.labels(self.session, who)
        speed, turn = speeds, turning
        for _ in range(ROUNDS):
            done = stride.strides(self.session, self.typical(speed, turn, who), labels)
            speed, turn = speed + speeds - done.speeds, turn + turning - done.turning
        return self.typical(speed, turn, who)


def of(session: Session) -> Gait:
    """Gait of a model; InvalidField where it is not of a cycle, stays in place or has one speed."""
    card = session.card
    if not card.cyclic:
        raise InvalidField("model", f"{card.name} is no cycle, expected one that can be repeated")
    if card.root != "travelling":
        raise InvalidField("model", f"{card.name} stays in place, expected one that travels")
    controls = np.array(card.examples)
    who = stride.movers(card)
    own = stride.strides(session, controls, stride.labels(session, who))
    rates = np.column_stack([own.speeds, own.turning])
    _refuse_one_speed(card.name, rates[:, 0])
    slopes = np.linalg.lstsq(_design(*rates.T), controls, rcond=None)[0]
    manners = _manners(controls - _design(*rates.T) @ slopes, who, len(card.performers))
    return Gait(session, rates, slopes, manners, region.hull(_with_straight(rates)))


def _refuse_one_speed(name: str, speeds: Floats) -> None:
    low, high = speeds.min(), speeds.max()
    if low < STILL or high - low < STILL:
        raise InvalidField(
            "model",
            f"{name} goes {low:.3f} to {high:.3f} m/s, expected one that travels at several speeds",
        )


def _with_straight(rates: Floats) -> Floats:
    """Rates and straight on at the slowest and the fastest: a stride cut from a straight walk turns
    by a few degrees either way, which nobody would take for the least that the walker can turn."""
    ends = np.array([rates[:, 0].min(), rates[:, 0].max()])
    return np.vstack([rates, np.column_stack([ends, np.zeros(2)])])


def _design(speeds: Floats, turning: Floats) -> Floats:
    return np.column_stack([np.ones(len(speeds)), speeds, turning])


def _manners(residuals: Floats, who: Indices, performers: int) -> Floats:
    """Mean residuals (p + 1, d) of performers, as if one clip more were usual; zeros at the end."""
    theirs = np.arange(performers)[:, None] == who
    means = theirs @ residuals / (theirs.sum(axis=1, keepdims=True) + 1.0)
    return np.vstack([means, np.zeros(residuals.shape[1])])
