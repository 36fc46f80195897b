"""A protocol's result as means over clips, as JSON and as a table."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from model_export.evaluate import columns, errors, flags, reach
from model_export.evaluate.errors import Errors
from model_export.evaluate.flags import Flags
from model_export.evaluate.methods import DEFINITIONS, EXACT, OURS
from model_export.evaluate.protocol import Result
from model_export.report import plain
from service.motion.conventions import Floats

DISTANCES = ("relative", "absolute", "plain_relative", "plain_absolute", "shell")
HEAD = (
    "method",
    "relative",
    "±",
    "less ours",
    "±",
    "global",
    "effector",
    "plain rel.",
    "plain glob.",
    "duration",
    "accel.",
    "skate",
)


@dataclass(frozen=True)
class Summary:
    """One method over all clips that it was asked for.

    clips, left_out: how many those are, and how many others there are. mean: its errors.
    standard_error, m: of the mean relative distance. worse, worse_error, m: by how much its
    relative distance exceeds ours on the same clip, and the standard error of that.
    """

    name: str
    clips: int
    left_out: int
    mean: Errors
    standard_error: float
    worse: float
    worse_error: float

    @property
    def skate(self) -> float:
        """Speed of its feet on the ground over that of the captured ones; 0 without feet."""
        captured = self.mean.skate_captured
        return self.mean.skate / captured if captured else 0.0

    def facts(self) -> dict[str, Any]:
        """Figures by name, distances in centimetres."""
        mean = self.mean
        return {
            "clips": self.clips,
            "clips_left_out": self.left_out,
            "relative_cm": centimetres(mean.relative.mean),
            "global_cm": centimetres(mean.absolute.mean),
            "effector_cm": centimetres(mean.effector),
            "plain_relative_cm": centimetres(mean.plain_relative.mean),
            "plain_global_cm": centimetres(mean.plain_absolute.mean),
            "standard_error_cm": centimetres(self.standard_error),
            "difference_cm": centimetres(self.worse),
            "difference_standard_error_cm": centimetres(self.worse_error),
            "duration_error": plain.number(mean.duration),
            "acceleration_ratio": plain.number(mean.acceleration),
            "skate_ratio": plain.number(self.skate) if mean.skate_captured else None,
            "skate_cm_per_s": centimetres(mean.skate),
            "distances_cm": {
                name: {
                    key: centimetres(value) for key, value in asdict(getattr(mean, name)).items()
                }
                for name in DISTANCES
            },
            "definition": DEFINITIONS[self.name],
        }

    def cells(self) -> tuple[str, ...]:
        """Its row of the table, in centimetres and shares."""
        mean = self.mean
        ours = self.name == OURS
        return (
            f"{self.name} ({self.clips} clips)" if self.left_out else self.name,
            _two(mean.relative.mean),
            _two(self.standard_error),
            "" if ours else f"{100 * self.worse:+.2f}",
            "" if ours else _two(self.worse_error),
            _two(mean.absolute.mean),
            "" if np.isnan(mean.effector) else _two(mean.effector),
            _two(mean.plain_relative.mean),
            _two(mean.plain_absolute.mean),
            f"{100 * mean.duration:.1f} %",
            f"{mean.acceleration:.2f}",
            f"{self.skate:.2f}" if mean.skate_captured else "",
        )


def _two(metres: float) -> str:
    return f"{100 * metres:.2f}"


def centimetres(metres: float) -> float | None:
    return None if np.isnan(metres) else plain.number(100.0 * metres)


def relative(found: Sequence[Errors]) -> Floats:
    """Mean relative distance (C,) of each clip, m."""
    return np.array([error.relative.mean for error in found])


def of(result: Result) -> list[Summary]:
    """Every method of a result, ours first."""
    return [_summary(result, name) for name in result.errors if result.asked(name)]


def _summary(result: Result, name: str) -> Summary:
    places = result.asked(name)
    found = result.of(name, places)
    own, ours = relative(found), relative(result.of(OURS, places))
    return Summary(
        name,
        len(found),
        len(result.clips) - len(found),
        errors.mean(found),
        _standard_error(own),
        float((own - ours).mean()),
        _standard_error(own - ours),
    )


def _standard_error(values: Floats) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0


def sigma_ratio(result: Result) -> float:
    """Mean of squared distance over squared prediction: one where sigma is right."""
    squared = np.array([error.squared for error in result.of(OURS, result.asked(OURS))])
    return float(np.mean(squared / np.square(result.sigma)))


def joint_sigma_ratios(result: Result) -> dict[str, float]:
    """The same for each joint alone, by name."""
    squared = np.stack([error.joints for error in result.of(OURS, result.asked(OURS))])
    ratios = np.mean(squared / np.square(result.joint_sigma), axis=0)
    return dict(zip(result.joints, ratios.tolist(), strict=True))


def flags_facts(found: Flags) -> dict[str, Any]:
    """How the support flag does, as JSON holds it."""
    facts = {
        "false_alarms": plain.number(found.alarms),
        "beyond": {name: plain.number(share) for name, share in found.beyond.items()},
    }
    if found.gap is None:
        return facts
    control, share = found.gap
    return {**facts, "gap": {"control": control, "flagged": plain.number(share)}}


def flags_said(found: Flags) -> str:
    """The same in a sentence."""
    beyond = ", ".join(f"{name} {100 * share:.0f}" for name, share in found.beyond.items())
    said = (
        f"support: {100 * found.alarms:.1f} % of held-out clips flagged; of those moved "
        f"{100 * flags.BEYOND:.0f} % of its range beyond a control, %: {beyond}"
    )
    if found.gap is None:
        return said
    control, share = found.gap
    return f"{said}; in the gap of {control}, %: {100 * share:.0f}"


def _joints_said(result: Result) -> str:
    """Sigma by joint in a sentence."""
    ratios = joint_sigma_ratios(result)
    least, most = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    return (
        f"sigma ratio by joint: median {np.median(list(ratios.values())):.2f}, "
        f"from {ratios[least]:.2f} ({least}) to {ratios[most]:.2f} ({most})"
    )


def facts(result: Result) -> dict[str, Any]:
    """Figures of a result as JSON holds them."""
    held = {} if result.flags is None else {"support": flags_facts(result.flags)}
    by_joint = joint_sigma_ratios(result)
    methods = {summary.name: summary.facts() for summary in of(result)}
    if EXACT in methods:
        methods[EXACT]["exact"] = reach.facts(result)
    return {
        "family": result.family,
        "protocol": result.protocol,
        "clips": len(result.clips),
        "sigma_ratio": plain.number(sigma_ratio(result)),
        "joint_sigma_ratio": {name: plain.number(ratio) for name, ratio in by_joint.items()},
        **held,
        "methods": methods,
    }


def table(result: Result) -> str:
    """A result in Markdown, the columns even for who reads it as it is."""
    title = (
        f"{result.family}, {result.protocol.replace('_', ' ')}: {len(result.clips)} motions, "
        f"sigma ratio {sigma_ratio(result):.2f}"
    )
    rows = columns.even(HEAD, [summary.cells() for summary in of(result)])
    return f"{title}\n\n{rows}"


def trust_said(result: Result) -> list[str]:
    """How sigma by joint and the support flag do, a sentence each."""
    return [_joints_said(result)] + ([flags_said(result.flags)] if result.flags else [])


LEGEND = (
    "Centimetres, mean over joints, frames and clips. relative: root position taken out; global: "
    "left in; both after slope-limited time warping; plain: at equal shares of the duration. "
    "less ours: the method's relative error less ours, clip by clip. effector: the event's joint "
    "at its event. duration: root mean square of the logarithm. accel., skate: synthesised over "
    "captured. sigma ratio: squared error over the squared error predicted. posefield_exact is "
    "told where the captured clip has the event's joint; beyond: places farther from the root."
)


def definitions(results: Sequence[Result]) -> str:
    """What each method of some results is, a line each."""
    names = dict.fromkeys(name for result in results for name in result.errors)
    return "\n".join(f"  {name}: {DEFINITIONS[name]}" for name in names)
