"""What answers can be held to, where they have support, how joints err, what to capture next."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from model_export.export import Exported
from model_export.report import plain
from model_export.report.page import Section, Table
from service.motion import measure, support
from service.motion.answer import Suggestion
from service.motion.card import ModelCard
from service.synthesis import session, suggest
from service.synthesis.suggest import SuggestQuestion
from service.synthesis.synthesizer import Synthesizer

# Joints that are named, and points to capture.
JOINTS, POINTS = 8, 8


@dataclass(frozen=True)
class Trust:
    """A model's card, the largest variance of the plain field that counts as support, and points to
    capture, the one that is worth most first."""

    card: ModelCard
    limit: float
    points: tuple[Suggestion, ...]

    @property
    def measured(self) -> dict[str, str]:
        """How each control is measured, in words, of those that are."""
        names = self.card.skeleton.names
        controls = [c for c in self.card.controls if c.measure]
        return {c.name: measure.words(c.measure, names) for c in controls if c.measure}

    @property
    def joints(self) -> dict[str, float]:
        """How far each joint errs, as a share of sigma, the farthest first."""
        both = zip(self.card.skeleton.names, self.card.joint_sigma, strict=True)
        return dict(sorted(both, key=lambda pair: -pair[1]))

    def facts(self) -> dict[str, Any]:
        """The same as plain values."""
        return {
            "measured": self.measured,
            "support_limit": plain.number(self.limit),
            "joint_sigma": self.joints,
            "suggestions": [
                {
                    "controls": {k: plain.number(v) for k, v in point.controls.items()},
                    "gain": plain.number(point.gain),
                    "lacking": point.lacking,
                }
                for point in self.points
            ],
        }

    def section(self) -> Section:
        """The same in words."""
        held = ", ".join(f"{name} ({how})" for name, how in self.measured.items())
        said = (
            f"Answers meet exactly what is given of: {held}."
            if held
            else "No control is measured on the motion: answers are held to targets alone.",
            "Controls lack support more than a tenth of a range beyond what was sampled, and where "
            f"the plain field's variance is above {self.limit:.2f}, as it is at one captured clip "
            "in twenty that is left out. Of points to capture the one that is worth most comes "
            "first, each as if those above it were captured.",
        )
        far = tuple((name, f"{share:.2f}") for name, share in list(self.joints.items())[:JOINTS])
        joints = Table(("joint", "sigma of it / sigma"), far)
        return Section("trust", "What answers may be trusted with", said, (self._next(), joints))

    def _next(self) -> Table:
        names = tuple(control.name for control in self.card.controls)
        rows = tuple(
            (*(f"{point.controls[name]:.4g}" for name in names), f"{100 * point.gain:.1f} %")
            for point in self.points
        )
        return Table((*names, "mean variance falls by"), rows)


def of(exported: Exported) -> Trust:
    """What the file says of itself."""
    card = exported.card
    opened = session.open_bytes(exported.content, card.name)
    found = suggest.suggest(Synthesizer(card.name, opened), SuggestQuestion(POINTS))
    return Trust(card, support.of(np.array(card.examples)).limit, found.suggestions)
