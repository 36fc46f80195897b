"""Limits of a model's predictions: measured controls, support, joint errors, suggested captures."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.inference import session
from posefield.kriging import support
from posefield.model_file.model_card import ModelCard
from posefield.motion import measures
from posefield.question.model_question import SuggestQuestion
from posefield.question.results import Suggestion
from posefield.synthesis import capture_suggestions
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.report.drawing import significant_digits
from posefield_train.report.drawing.html_page import Section, Table

# Joints named, and captures suggested.
LISTED_JOINTS, POINTS = 8, 8


@dataclass(frozen=True)
class Reliability:
    """Limits of a model's predictions.

    limit: largest variance of supported controls. points: suggested captures, the one that reduces
    the variance most first.
    """

    card: ModelCard
    limit: float
    points: tuple[Suggestion, ...]

    @property
    def measured(self) -> dict[str, str]:
        """Return the controls that are measured on the motion, and their measures in words."""
        names = self.card.skeleton.names
        controls = [c for c in self.card.controls if c.measure]
        return {c.name: measures.describe(c.measure, names) for c in controls if c.measure}

    @property
    def joints(self) -> dict[str, float]:
        """Return sigma of each joint over sigma of the pose, the largest first."""
        both = zip(self.card.skeleton.names, self.card.joint_sigma, strict=True)
        return dict(sorted(both, key=lambda pair: -pair[1]))

    def facts(self) -> dict[str, Any]:
        """Return the limits as JSON values."""
        return {
            "measured": self.measured,
            "support_limit": significant_digits.round_number(self.limit),
            "joint_sigma": self.joints,
            "suggestions": [
                {
                    "controls": {
                        k: significant_digits.round_number(v) for k, v in point.controls.items()
                    },
                    "gain": significant_digits.round_number(point.gain),
                    "lacking": point.lacking,
                }
                for point in self.points
            ],
        }

    def section(self) -> Section:
        """Return the limits as text and tables."""
        names = ", ".join(f"{name} ({how})" for name, how in self.measured.items())
        paragraphs = (
            f"Answers match these measured controls exactly: {names}."
            if names
            else "No control is measured on the motion: answers match exactly only the targets of "
            "a request.",
            f"Controls count as supported up to {100 * support.RANGE_MARGIN:g} % "
            "of a range beyond the "
            f"captured clips, where the variance of the support model is at most {self.limit:.2f}. "
            "Of the captured clips, each left out in turn, "
            f"{100 * support.SUPPORT_QUANTILE:g} % are "
            "within that limit.",
            "Each suggested capture assumes that those above it were captured.",
        )
        shares = list(self.joints.items())[:LISTED_JOINTS]
        rows = tuple((name, f"{share:.2f}") for name, share in shares)
        joints = Table("Joints with the largest error", ("joint", "sigma relative to pose"), rows)
        return Section("trust", "Limits of the answers", paragraphs, (self._suggested(), joints))

    def _suggested(self) -> Table:
        names = tuple(control.name for control in self.card.controls)
        rows = tuple(
            (
                str(place),
                *(f"{point.controls[name]:.4g}" for name in names),
                f"{100 * point.gain:.1f} %",
            )
            for place, point in enumerate(self.points, start=1)
        )
        heading = ("order", *names, "mean variance falls by")
        return Table("Suggested captures", heading, rows)


def measure_reliability(exported: ExportedModel) -> Reliability:
    """Return the limits of an exported model."""
    card = exported.card
    opened = session.open_bytes(exported.content, card.name)
    found = capture_suggestions.suggest(
        Synthesizer(card.name, opened), SuggestQuestion(count=POINTS)
    )
    return Reliability(card, support.fit_support(np.array(card.examples)).limit, found.suggestions)
