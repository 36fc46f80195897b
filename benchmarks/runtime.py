"""A clip through onnxruntime, ours against naive kriging in the same engine."""

import os

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

from dataclasses import dataclass
from typing import Any

import naive_graphs
import numpy as np
import onnxruntime
from family import Family
from naive_graphs import Contents
from rows import Row
from timing import in_turn

from posefield.model_file import onnx_file
from posefield.model_file.model_card import ROW_VALUES
from posefield.synthesis.poses import POSE_OUTPUTS

FRAMES, POSES = 100, 256
TRAINING = "training, alignment and tuning included"


@dataclass(frozen=True)
class Asked:
    """A session and what it is fed."""

    session: Any
    feed: dict[str, Any]

    def __call__(self, outputs: list[str] | None = None) -> Any:
        """Answers of the session."""
        return self.session.run(outputs, self.feed)


def rows(trained_family: Family) -> list[Row]:
    """A clip of 100 frames, a single pose, what pruning saves, and the file's size."""
    model = trained_family.trained.model
    content, same = (
        naive_graphs.fitted(trained_family, chart)
        for chart in (naive_graphs.VECTORS, "stereographic")
    )
    point = _between(trained_family)
    duration = model.evaluate(point, np.zeros((1, 1))).duration[0]
    times = np.linspace(0.0, duration, FRAMES)[None]
    query = {"controls": point.astype(np.float32), "time": times.astype(np.float32)}
    ours = {name: Asked(_own(trained_family, outputs), query) for name, outputs in OURS.items()}
    rivals = {
        name: Asked(_session(made_by()), query)
        for name, made_by in (
            ("once", content.every_frame_once),
            ("dual", content.every_frame_once_dual),
            ("gathered", content.gathered),
        )
    }
    chart = {"same": Asked(_session(same.every_frame_once_dual()), query)}
    naive_graphs.check(content, rivals, point, times)
    naive_graphs.check(same, chart, point, times)
    timings = in_turn({**ours, **rivals, **chart}, rounds=15, repeats=30)
    return [
        *(_clip_row(timings, name, words, goal) for name, words, goal in RIVALS),
        _clip_row(timings, "dual", f"{DUAL}, rotations and root alone", 5.0, "alone"),
        *_batch_rows(trained_family, content, ours["ours"]),
        *_small_rows(trained_family, ours["ours"], query),
    ]


def _own(trained_family: Family, outputs: tuple[str, ...]) -> Any:
    """Return a session on outputs of the model at its finest level, as the service opens it."""
    values = [ROW_VALUES[output] for output in outputs]
    fixed = onnx_file.fix_level(trained_family.exported.content, 0)
    return _session(onnx_file.select_outputs(fixed, *values))


def _batch_rows(trained_family: Family, content: Contents, ours: Asked) -> list[Row]:
    """Poses of as many questions, each at its own time."""
    model = trained_family.trained.model
    rng = np.random.Generator(np.random.PCG64(POSES))
    controls = rng.uniform(model.bank.low, model.bank.high, (POSES, len(model.bank.low)))
    controls = controls.astype(np.float32).astype(float)
    durations = model.evaluate(controls, np.zeros((POSES, 1))).duration
    times = (rng.uniform(0.0, 1.0, POSES) * durations).astype(np.float32).astype(float)[:, None]
    query = {"controls": controls.astype(np.float32), "time": times.astype(np.float32)}
    rivals = {
        "for each question its two frames' inverses and samples": content.batch,
        "the same with inverse and samples multiplied beforehand": content.batch_dual,
    }
    runs = {words: Asked(_session(made_by()), query) for words, made_by in rivals.items()}
    naive_graphs.check(content, runs, controls, times)
    timings = in_turn({"ours": Asked(ours.session, query), **runs}, rounds=15, repeats=10)
    name, mine = f"{POSES} poses, one call", timings["ours"]
    return [
        Row(name, 1e6 * mine, "µs", WORDS + words, timings[words] / mine, 7.0) for words in rivals
    ]


WORDS = (
    "naive kriging in onnxruntime, same questions and answers (controls and seconds to rotations): "
)
DUAL = WORDS + "the same with inverse and samples multiplied beforehand"
RIVALS = (
    (
        "once",
        WORDS + "for each of the 100 frames weights from the inverse of its system, averages of "
        "the full samples by them, then interpolation to the times asked for",
        20.0,
    ),
    ("dual", DUAL, 3.5),
    ("same", DUAL + ", in the chart of ours", None),
    (
        "gathered",
        WORDS + "for each time asked for its two frames' inverses and samples are gathered, as the "
        "time basis is in ours",
        20.0,
    ),
)
OURS = {"ours": POSE_OUTPUTS, "alone": ("rotations", "root_position")}


def _clip_row(
    timings: dict[str, float], name: str, words: str, goal: float | None, ours: str = "ours"
) -> Row:
    ratio = timings[name] / timings[ours]
    return Row(f"clip of {FRAMES} frames, one call", 1e6 * timings[ours], "µs", words, ratio, goal)


def _small_rows(trained_family: Family, ours: Asked, query: dict[str, Any]) -> list[Row]:
    one = Asked(ours.session, {**query, "time": query["time"][:, :1]})
    timings = in_turn(
        {
            "pose": one,
            "duration": Asked(_own(trained_family, ("duration",)), {"controls": query["controls"]}),
        },
        rounds=15,
        repeats=100,
    )
    return [
        Row("single pose, one call", 1e6 * timings["pose"], "µs", "", None, None),
        Row(
            "duration alone, one call",
            1e6 * timings["duration"],
            "µs",
            "all outputs, which a session computes whether or not they are asked for",
            timings["pose"] / timings["duration"],
            None,
        ),
        Row("model file", len(trained_family.exported.content) / 1e3, "kB", "", None, 120.0),
        Row(TRAINING, trained_family.seconds, "s", "", None, 30.0),
    ]


def _between(trained_family: Family) -> Any:
    """A control point (1, d) between two samples."""
    return np.mean(
        [trained_family.examples[4].controls, trained_family.examples[9].controls], axis=0
    )[None]


def _session(content: bytes) -> Any:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
