"""A clip through onnxruntime, ours against naive kriging in the same engine."""

import os

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

from dataclasses import dataclass
from typing import Any

import naive_graphs
import numpy as np
import onnxruntime
from family import Family
from rows import Row
from timing import in_turn

from posefield.model_file import subgraph
from posefield_train.kriging import naive_kriging, variogram

FRAMES, POSES = 100, 256


@dataclass(frozen=True)
class Asked:
    """A session and what it is fed."""

    session: Any
    feed: dict[str, Any]

    def __call__(self, outputs: list[str] | None = None) -> Any:
        """Answers of the session."""
        return self.session.run(outputs, self.feed)


def rows(made: Family) -> list[Row]:
    """A clip of 100 frames, a single pose, what pruning saves, and the file's size."""
    model = made.trained.model
    field = naive_kriging.fit_naive(
        model.bank.pose.samples,
        naive_graphs.positions(made),
        naive_graphs.numbers(made),
        "matern52",
        variogram.fit_by_grid,
    )
    content = naive_graphs.Contents(made, field)
    point = _between(made)
    duration = model.evaluate(point, np.zeros((1, 1))).duration[0]
    times = np.linspace(0.0, duration, FRAMES)[None]
    asked = {"controls": point.astype(np.float32), "time": times.astype(np.float32)}
    # As the service opens it.
    ours = Asked(_session(subgraph.fix_level(made.exported.content, 0)), asked)
    rivals = {
        name: Asked(_session(made_by()), asked)
        for name, made_by in (
            ("once", content.every_frame_once),
            ("dual", content.every_frame_once_dual),
            ("gathered", content.gathered),
        )
    }
    naive_graphs.check(made, field, rivals, point, times)
    taken = in_turn({"ours": ours, **rivals}, rounds=15, repeats=30)
    return [
        *(_clip_row(taken, name, words, goal) for name, words, goal in RIVALS),
        *_batch_rows(made, field, ours),
        *_small_rows(made, ours, asked),
    ]


def _batch_rows(made: Family, field: naive_kriging.NaiveKriging, ours: Asked) -> list[Row]:
    """Poses of as many questions, each at its own time."""
    model = made.trained.model
    rng = np.random.Generator(np.random.PCG64(POSES))
    controls = rng.uniform(model.bank.low, model.bank.high, (POSES, len(model.bank.low)))
    controls = controls.astype(np.float32).astype(float)
    durations = model.evaluate(controls, np.zeros((POSES, 1))).duration
    times = (rng.uniform(0.0, 1.0, POSES) * durations).astype(np.float32).astype(float)[:, None]
    asked = {"controls": controls.astype(np.float32), "time": times.astype(np.float32)}
    content = naive_graphs.Contents(made, field)
    rivals = {
        "for each question its two frames' inverses and samples": content.batch,
        "the same with inverse and samples multiplied beforehand": content.batch_dual,
    }
    runs = {words: Asked(_session(made_by()), asked) for words, made_by in rivals.items()}
    naive_graphs.check(made, field, runs, controls, times)
    taken = in_turn({"ours": Asked(ours.session, asked), **runs}, rounds=15, repeats=10)
    name, mine = f"{POSES} poses, one call", taken["ours"]
    return [
        Row(name, 1e6 * mine, "µs", WORDS + words, taken[words] / mine, 7.0) for words in rivals
    ]


WORDS = (
    "naive kriging in onnxruntime, same questions and answers (controls and seconds to rotations): "
)
RIVALS = (
    (
        "once",
        WORDS + "for each of the 100 frames weights from the inverse of its system, averages of "
        "the full samples by them, then interpolation to the times asked for",
        20.0,
    ),
    ("dual", WORDS + "the same with inverse and samples multiplied beforehand", 20.0),
    (
        "gathered",
        WORDS + "for each time asked for its two frames' inverses and samples are gathered, as the "
        "time basis is in ours",
        20.0,
    ),
)


def _clip_row(taken: dict[str, float], name: str, words: str, goal: float | None) -> Row:
    ratio = taken[name] / taken["ours"]
    return Row(f"clip of {FRAMES} frames, one call", 1e6 * taken["ours"], "µs", words, ratio, goal)


def _small_rows(made: Family, ours: Asked, asked: dict[str, Any]) -> list[Row]:
    one = Asked(ours.session, {**asked, "time": asked["time"][:, :1]})
    taken = in_turn(
        {
            "pose": one,
            "duration": lambda: one(["duration"]),
        },
        rounds=15,
        repeats=100,
    )
    return [
        Row("single pose, one call", 1e6 * taken["pose"], "µs", "", None, None),
        Row(
            "duration alone, one call",
            1e6 * taken["duration"],
            "µs",
            "all outputs: onnxruntime does not leave out what nobody asks for",
            taken["pose"] / taken["duration"],
            None,
        ),
        Row("model file", len(made.exported.content) / 1e3, "kB", "", None, 120.0),
        Row("training, alignment and tuning included", made.seconds, "s", "", None, 30.0),
    ]


def _between(made: Family) -> Any:
    """A control point (1, d) between two samples."""
    return np.mean([made.examples[4].controls, made.examples[9].controls], axis=0)[None]


def _session(content: bytes) -> Any:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
