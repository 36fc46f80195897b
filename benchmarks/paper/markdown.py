"""Table 1 as Markdown: printed figures, measured figures and the definition of each baseline."""

from paper import poses, precomputation
from paper.measurement import CORE_GOAL, SEARCHED, SHOWN, Baseline, Size, Table1
from posefield_train.graph.truncation_cost import RankCost

# Table 1 as printed: threshold, ranks, seconds of precomputation, milliseconds per pose.
PAPER = (
    ("paper, naive", (92, 100, 92), 119.8, 2.76),
    ("paper, 500", (22, 6, 24), 6.0, 0.84),
    ("paper, 750", (18, 6, 28), 6.4, 0.81),
    ("paper, 1000", (20, 6, 20), 6.3, 0.83),
)
_HEAD = (
    "| threshold or ranks | tensor | core alone | all stored | error, cm | from naive, cm "
    "| precompute | × | pose | × |\n|---|---|---|---|---|---|---|---|---|---|"
)


def text(table: Table1) -> str:
    """Return the table with its caption and goals."""
    freedoms, frames, samples = table.raw
    size = f"{freedoms} × {frames} × {samples}"
    before = next(one for one in table.precompute if one.name == SEARCHED)
    single = next(one for one in table.pose if one.name == poses.AIMED)
    ours = [_row(size, before, single) for size in table.sizes]
    return "\n".join(
        [
            f"Table 1 (Mukai & Kuriyama 2006), the procedural family of {size}, {table.joints} "
            f"joints, {table.points} control points",
            "",
            _HEAD,
            *_paper_rows(),
            f"| naive | {size} | 1 | 1 | | 0 | {1e3 * before.seconds:.0f} ms | 1 "
            f"| {1e6 * single.seconds:.2f} µs | 1 |",
            *ours,
            "",
            _caption(table),
            "",
            *_goals(table),
        ]
    )


def _paper_rows() -> list[str]:
    _, raw, slow, late = PAPER[0]
    rows = []
    for threshold, (r1, r2, r3), seconds, milliseconds in PAPER:
        core = raw[0] * raw[1] * raw[2] / (r1 * r2 * r3)
        stored = raw[0] * raw[1] * raw[2] / RankCost(raw).evaluate(r1, r2, r3) if core > 1 else 1.0
        rows.append(
            f"| {threshold} | {r1} × {r2} × {r3} | {core:.0f} | {stored:.0f} | | | {seconds} s "
            f"| {slow / seconds:.1f} | {milliseconds} ms | {late / milliseconds:.1f} |"
        )
    return rows


def _row(size: Size, before: Baseline, single: Baseline) -> str:
    r1, r2, r3 = size.ranks
    return (
        f"| {size.threshold} | {r1} × {r2} × {r3} | {size.core:.0f} | {size.stored:.0f} "
        f"| {100 * size.error:.0f} | {100 * size.from_naive:.0f} "
        f"| {1e3 * size.precompute:.1f} ms | {before.seconds / size.precompute:.1f} "
        f"| {1e6 * size.pose:.2f} µs | {single.seconds / size.pose:.1f} |"
    )


def _caption(table: Table1) -> str:
    return (
        "Error: distances summed over joints and frames, root mean square over control points "
        "uniform in the sampled box, against full rank with the same kriging weights. The paper "
        "compares with naive kriging of every frame; from that even full rank is "
        f"{100 * table.full_from_naive:.0f} cm away, because its weights differ. The paper's "
        "thresholds have no unit: assuming centimetres, the paper's tensors come near them here; "
        "one row assumes millimetres. Core alone: raw numbers over r1 r2 r3. All stored: bases and "
        "kriging weights included; the paper's figure is computed from its sizes with one weight "
        "per sample. ×: ratio to naive kriging, for precomputation with variograms fitted by "
        f"{SEARCHED}, for a pose with the form {poses.AIMED!r}. One thread, medians of alternating "
        f"runs. Posefield's precomputation: {precomputation.OURS}. Posefield's pose: {poses.OURS}."
    )


def _goals(table: Table1) -> list[str]:
    ranks = " × ".join(map(str, SHOWN))
    lines = [
        f"| naive method | time | over posefield at {ranks} | goal | met |",
        "|---|---|---|---|---|",
    ]
    lines += [_baseline(one, 1e3, "ms") for one in table.precompute]
    lines += [_baseline(one, 1e6, "µs") for one in table.pose]
    core = [
        f"core alone at {size.threshold}: {size.core:.0f}, goal {CORE_GOAL:g}: "
        f"{'met' if size.core >= CORE_GOAL else 'missed'}"
        for size in table.sizes
        if size.threshold.startswith("500 ")
    ]
    return [*lines, "", *core]


def _baseline(one: Baseline, scale: float, unit: str) -> str:
    goal = "" if one.goal is None else f"{one.goal:g}"
    met = "" if one.goal is None else ("yes" if one.ratio >= one.goal else "**no**")
    return f"| {one.words} | {scale * one.seconds:.3g} {unit} | {one.ratio:.1f} | {goal} | {met} |"
