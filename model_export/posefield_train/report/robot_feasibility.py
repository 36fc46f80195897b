"""Feasibility of a robot's motions over the box of commands, as a page and as JSON.

The model answers commands all over the box; inverse dynamics tells the forces of each answer.
"""

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import qmc

from posefield.model import Clip, Model
from posefield.model_file.model_card import Control
from posefield_train.report import significant_digits
from posefield_train.report.page import (
    BLUE,
    FAINT,
    GREY,
    ORANGE,
    Chart,
    Page,
    Section,
    Table,
    draw_chart,
)
from posefield_train.robots import doctor
from posefield_train.robots.robot_dynamics import Dynamics

MOST_COMMANDS = 250
"""Commands of a grid; of more, so many are drawn evenly in the box."""
LISTED = 25
"""Commands of a table."""


@dataclass(frozen=True)
class Quantity:
    """Quantity of an answer. key: in the JSON. scale: of the unit. bound: largest that is fine."""

    key: str
    title: str
    unit: str
    scale: float
    bound: float

    def text(self, value: float | None) -> str:
        """Return a value in the unit."""
        return "" if value is None else f"{self.scale * value:.3g}"


QUANTITIES = (
    Quantity("limit_rad", "joint beyond its limits", "degrees", 180.0 / np.pi, np.radians(0.1)),
    Quantity("torque_share", "torque over the actuator's limit", "", 1.0, 1.0),
    Quantity("zero_moment_m", "zero-moment point beyond the soles", "cm", 100.0, 0.01),
    Quantity("lacking_share", "force that soles cannot give", "% of the weight", 100.0, 0.05),
    Quantity("skate_m_s", "median speed of standing feet", "cm/s", 100.0, 0.01),
    Quantity("penetration_m", "soles below the floor", "mm", 1000.0, 0.002),
    Quantity("seam_rad", "step at the seam", "rad", 1.0, 1e-6),
)
"""Zero moments and forces are 95th percentiles of the frames that stand, others the worst."""


@dataclass(frozen=True)
class Feasibility:
    """Answers of a model over its commands. rows: figures of each, as in the JSON."""

    model: Model
    robot: str
    rows: Sequence[dict[str, Any]]

    @property
    def broken(self) -> list[dict[str, Any]]:
        """Return the rows with a quantity beyond its bound."""
        return [row for row in self.rows if row["broken"]]

    def json(self) -> bytes:
        """Return all figures: metres, radians, seconds and shares."""
        bounds = {quantity.key: quantity.bound for quantity in QUANTITIES}
        facts = {"robot": self.robot, "bounds": bounds, "commands": list(self.rows)}
        return (json.dumps(significant_digits.round_all(facts), indent=1) + "\n").encode()

    def html(self) -> bytes:
        """Return the page."""
        card = self.model.synthesizer.session.card
        worst = [
            (f"largest {quantity.title}", f"{quantity.text(largest)} {quantity.unit}".strip())
            for quantity in QUANTITIES
            if (largest := _largest(self.rows, quantity.key)) is not None
        ]
        figures = [
            ("commands", str(len(self.rows))),
            ("commands that break a bound", str(len(self.broken))),
            *worst,
        ]
        lead = f"{card.description}. Robot: {self.robot}."
        sections = [self._charts(), self._table()]
        return Page("feasibility", card.name, lead, figures, sections).html()

    def _charts(self) -> Section:
        controls = self.model.synthesizer.session.card.controls
        quantities = [row for row in QUANTITIES if _largest(self.rows, row.key) is not None]
        paragraphs = (
            "Each point is a command over the captured ranges: blue within the bound, which is a "
            "line, orange beyond it, grey where commands have no captured motions near.",
        )
        charts = tuple(_chart(self.rows, quantity, controls) for quantity in quantities)
        return Section("commands", "Over the commands", paragraphs, (), charts)

    def _table(self) -> Section:
        controls = self.model.synthesizer.session.card.controls
        rows = sorted(self.broken, key=lambda row: (not row["supported"], -len(row["broken"])))
        cells = tuple(
            (
                *(f"{row['controls'][control.name]:.3g}" for control in controls),
                "yes" if row["supported"] else "no",
                *(quantity.text(row[quantity.key]) for quantity in QUANTITIES),
                row["where"],
            )
            for row in rows[:LISTED]
        )
        heading = (
            *(f"{control.name}, {control.unit}" for control in controls),
            "supported",
            *(f"{each.title}{each.unit and ', '}{each.unit}" for each in QUANTITIES),
            "worst joint",
        )
        caption = f"{len(rows)} of {len(self.rows)} commands break a bound; first {len(cells)}"
        tables = (Table(caption, heading, cells),) if cells else ()
        text = "" if cells else "No command breaks a bound."
        return Section("broken", "Commands that break a bound", (text,) if text else (), tables)


def measure(model: Model, dynamics: Dynamics, per_control: int) -> Feasibility:
    """Return the answers of a model of a robot at commands over their captured ranges."""
    rows = []
    card = model.synthesizer.session.card
    for command in commands(card.controls, per_control):
        # At the model's own frames: between them poses are blended, which kinks no force has.
        duration = model.pose(0.0, **command).trust.duration
        rate = (card.frames - (0 if card.cyclic else 1)) / duration
        clip = model.clip(**command, fps=rate, loop=card.cyclic)
        rows.append(_row(clip, command, dynamics))
    return Feasibility(model, dynamics.robot.name, rows)


def commands(controls: Sequence[Control], per_control: int) -> list[dict[str, float]]:
    """Return the commands of a grid over the captured ranges, or as many as fit, evenly spread."""
    names = [control.name for control in controls]
    low = np.array([control.minimum for control in controls])
    high = np.array([control.maximum for control in controls])
    if per_control ** len(controls) <= MOST_COMMANDS:
        axes = [np.linspace(*ends, per_control).tolist() for ends in zip(low, high, strict=True)]
        return [dict(zip(names, values, strict=True)) for values in itertools.product(*axes)]
    shares = qmc.Halton(len(controls), scramble=False).random(MOST_COMMANDS)
    return [dict(zip(names, row, strict=True)) for row in (low + shares * (high - low)).tolist()]


def _row(clip: Clip, command: dict[str, float], dynamics: Dynamics) -> dict[str, Any]:
    robot = dynamics.robot
    motion = clip.robot_motion()
    diagnosis = doctor.diagnose(motion, robot)
    loads = dynamics.loads(motion, diagnosis.contacts)
    # Of the prediction: the answer is kept within the limits.
    excess = {
        broken.joint: max(broken.limits[0] - broken.angle, broken.angle - broken.limits[1])
        for broken in clip.trust.limits
    }
    shares = loads.shares
    heaviest = robot.hinges[int(shares.max(axis=0).argmax())]
    standing = np.isfinite(loads.zero_moment)
    sliding = diagnosis.slides[np.isfinite(diagnosis.slides)]
    figures = {
        "limit_rad": max(excess.values(), default=0.0),
        "torque_share": float(shares.max()),
        "zero_moment_m": _high(loads.zero_moment[standing]),
        "lacking_share": _high(loads.lacking[standing]),
        # A mean would tell how feet touch down, which no frame separates from standing.
        "skate_m_s": float(np.median(sliding)) if len(sliding) else None,
        "penetration_m": max(0.0, -float(diagnosis.heights.min(initial=0.0))),
        "seam_rad": float(np.abs(motion.angles[-1] - motion.angles[0]).max())
        if motion.loops
        else None,
    }
    return {
        "controls": command,
        "supported": clip.trust.supported,
        "sigma_m": clip.trust.sigma,
        **figures,
        "where": max(excess, key=excess.__getitem__, default=heaviest),
        "broken": [
            quantity.key
            for quantity in QUANTITIES
            if (value := figures[quantity.key]) is not None and value > quantity.bound
        ],
    }


def _high(values: np.ndarray[Any, Any]) -> float | None:
    """Return the 95th percentile of values of frames that stand; None if none does."""
    return max(float(np.percentile(values, 95.0)), 0.0) if len(values) else None


def _largest(rows: Sequence[dict[str, Any]], key: str) -> float | None:
    """Return the largest value of a quantity; None where no command has one."""
    return max((row[key] for row in rows if row[key] is not None), default=None)


def _chart(
    rows: Sequence[dict[str, Any]], quantity: Quantity, controls: Sequence[Control]
) -> Chart:
    """Return a panel for each control with the quantity of all commands."""
    rows = [row for row in rows if row[quantity.key] is not None]
    values = quantity.scale * np.array([row[quantity.key] for row in rows])
    bound = quantity.scale * quantity.bound
    beyond = values > bound
    supported = np.array([row["supported"] for row in rows])
    groups = ((supported & ~beyond, BLUE), (supported & beyond, ORANGE), (~supported, FAINT))

    def paint(figure: Figure) -> None:
        panels = figure.subplots(1, len(controls), sharey=True, squeeze=False)[0]
        for ax, control in zip(panels, controls, strict=True):
            points = np.array([row["controls"][control.name] for row in rows])
            for group, colour in groups:
                ax.plot(points[group], values[group], "o", color=colour, markersize=3.5)
            if values.max(initial=0.0) > 0.2 * bound:
                ax.axhline(bound, color=GREY, linewidth=1.0)
            ax.set_xlabel(f"{control.name}, {control.unit}")
            ax.set_ylim(bottom=min(0.0, float(values.min(initial=0.0))))
        panels[0].set_ylabel(quantity.unit or "share")
        panels[0].set_title(quantity.title)

    count = int((beyond & supported).sum())
    caption = (
        f"{quantity.title}: at most {quantity.text(_largest(rows, quantity.key))} {quantity.unit}; "
        f"{count} of {int(supported.sum())} supported commands lie beyond the bound of "
        f"{bound:.3g} {quantity.unit}."
    )
    return draw_chart(2.4, paint, f"{quantity.title} over each control.", caption)
