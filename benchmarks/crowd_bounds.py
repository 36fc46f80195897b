"""Limits of a pose's time: floating-point work or memory, and the time of each operator."""

from collections.abc import Callable

import crowd_machine
import crowd_profile
import crowd_scene
from crowd_machine import Machine
from crowd_profile import Part
from family import Family
from rows import Row
from timing import in_turn

from posefield.inference.onnx_runtime import OUTPUTS
from posefield.synthesis import crowd_synthesis
from posefield.synthesis.synthesizer import Synthesizer

BATCH = crowd_synthesis.MOST_ROWS

Profile = dict[str, Part]


def rows(trained_family: Family, model: Synthesizer) -> list[Row]:
    """The machine's own bounds, how near the finest and the coarsest level come, and a profile."""
    levels = {"finest": 0, "coarsest": len(model.session.card.levels) - 1}
    scene = crowd_scene.around(model, BATCH)
    feed = {"controls": scene.controls.astype("f4"), "time": scene.times[:, None].astype("f4")}
    runs = {name: _run(model, feed, level) for name, level in levels.items()}
    one = _run(model, {key: rows[:1] for key, rows in feed.items()}, levels["coarsest"])
    timings = in_turn({**runs, "one": one}, rounds=15, repeats=10)
    machine = crowd_machine.measure()
    content = trained_family.exported.content
    profiles = {name: crowd_profile.of(content, level, feed) for name, level in levels.items()}
    table_rows = [
        _bound_rows(model, name, timings[name] / BATCH, machine, profiles[name]) for name in levels
    ]
    return [
        *machine.rows(),
        *(row for three in table_rows for row in three),
        _fixed_row(timings["one"], timings["coarsest"]),
        *_profile_rows(profiles),
    ]


def _run(model: Synthesizer, feed: crowd_profile.Feed, level: int) -> Callable[[], object]:
    controls, time = feed["controls"], feed["time"]
    return lambda: model.session.run(controls, time, *OUTPUTS, level=level)


def _bound_rows(
    model: Synthesizer, name: str, seconds: float, machine: Machine, profile: Profile
) -> list[Row]:
    """Shares of what one core can do, of a pose in so many seconds at a level of that name."""
    card = model.session.card
    operations = card.levels[0 if name == "finest" else -1].operations
    # Rotations and bone offsets of every joint; root, travel, duration and sigma.
    out = 4 * (7 * len(card.skeleton) + 8)
    passed = 8 * sum(group_profile.numbers for group_profile in profile.values()) // BATCH
    pace = f"in {1e6 * seconds:.3g} µs"
    shares = {
        f"float32: {operations:,} multiply-adds a pose {pace}": operations / machine.work,
        f"copies within its cache: all operators' results, {passed:,} bytes "
        f"a pose written and read again {pace}": passed / machine.near,
        f"copies in memory: the answer, {out:,} bytes a pose {pace}": out / machine.far,
    }
    return [
        Row(f"{name}, share of what a core can do", 100 * share / seconds, "%", words, None, None)
        for words, share in shares.items()
    ]


def _fixed_row(one: float, batch: float) -> Row:
    words = f"one pose, {1e6 * one:.3g} µs, against {BATCH} in {1e6 * batch:.3g} µs"
    return Row("coarsest: what a call costs by itself", 100 * one / batch, "%", words, None, None)


def _profile_rows(profiles: dict[str, Profile]) -> list[Row]:
    groups = sorted(profiles["finest"], key=lambda group: -profiles["finest"][group].seconds)
    return [_part_row(group, profiles) for group in groups]


def _part_row(group: str, profiles: dict[str, Profile]) -> Row:
    """Microseconds a pose at the coarsest level, and the shares of both levels' runs."""
    words = "; ".join(
        f"{name} {1e6 * profile[group].seconds / BATCH:.3g} µs, "
        f"{100 * profile[group].seconds / sum(one.seconds for one in profile.values()):.0f} %"
        for name, profile in profiles.items()
    )
    finest, coarsest = (profiles[name][group].seconds for name in ("finest", "coarsest"))
    microseconds = 1e6 * coarsest / BATCH
    return Row(f"coarsest, profiled: {group}", microseconds, "µs", words, finest / coarsest, None)
