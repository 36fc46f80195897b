"""The same crowd by naive kriging and by SciPy's interpolator: controls in, quaternions out.

One thread on every side. In NumPy naive kriging asks each frame's field at once of all the
characters who are at that frame; in onnxruntime it is as in the rows of 256 poses.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import crowd_frames
import crowd_scene
import naive_graphs
import numpy as np
import onnxruntime
from crowd_frames import Answer, Questions
from crowd_scene import AUTO, Scene
from family import Family
from naive_graphs import VECTORS, Contents
from rows import Row
from scipy.interpolate import RBFInterpolator
from timing import in_turn

from posefield.common.units import Indices, Singles
from posefield.inference.onnx_runtime import OUTPUTS
from posefield.synthesis import crowd_synthesis
from posefield.synthesis.synthesizer import Synthesizer

BATCH = crowd_synthesis.MOST_ROWS

MANY, FEW, CHECKED = 10_000, 1_000, 200
TOGETHER = 128
"""Characters of a rival's call that gathers two systems for each: more would leave the cache."""
SOLVED, DUAL, GATHERED, GATHERED_DUAL = (
    f"naive kriging {words}"
    for words in (
        "in NumPy, systems solved by LU factors made beforehand",
        "in NumPy, inverse and samples multiplied beforehand",
        "in onnxruntime, for each character its two frames' inverses and samples",
        "in onnxruntime, the same with inverse and samples multiplied beforehand",
    )
)
SCIPY = (
    "SciPy's RBFInterpolator, thin plate, of the whole aligned sample motions, the frame taken and "
    f"decoded afterwards; {FEW:,} characters timed"
)


@dataclass(frozen=True)
class Asked:
    """A crowd, and its questions as rivals take them."""

    scene: Scene
    questions: Questions


def rows(made: Family, model: Synthesizer) -> list[Row]:
    """Ours, at levels by view and at the finest, against every rival."""
    content = naive_graphs.fitted(made, VECTORS)
    _check(content, _asked(made, crowd_scene.around(model, CHECKED)))
    asked = _asked(made, crowd_scene.around(model, MANY))
    few = _asked(made, crowd_scene.around(model, FEW))
    levels = asked.scene.poses(AUTO)().levels
    runs = {
        "auto": _ours(asked.scene, levels),
        "finest": _ours(asked.scene, np.zeros_like(levels)),
        **_naive(content, asked),
    }
    taken = in_turn(runs, rounds=9, repeats=1)
    scipys = (
        in_turn({"scipy": _scipy(made, few.questions)}, rounds=5, repeats=1)["scipy"] * MANY / FEW
    )
    return [_row(name, {**taken, SCIPY: scipys}) for name in [*list(runs)[2:], SCIPY]]


def _row(name: str, taken: dict[str, float]) -> Row:
    ratio = taken[name] / taken["auto"]
    finest = f"ours all at the finest: {1e3 * taken['finest']:.3g} ms"
    words = f"{name}: {1e3 * taken[name]:.3g} ms; {finest}"
    title = f"crowd of {MANY:,}, levels by view, graph alone on one thread"
    return Row(title, 1e3 * taken["auto"], "ms", words, ratio, None)


def _asked(made: Family, scene: Scene) -> Asked:
    model = made.trained.model
    # The procedural family's performers are not told apart.
    points = model.bank.points(scene.controls, np.zeros((len(scene), 0)))
    fields = model.bank.numpy(points)
    _, place = model.timing.numpy(fields["duration"], fields["warp"], scene.times[:, None])
    below = np.minimum(place[:, 0].astype(int), model.timing.frames - 2)
    share = (place - below[:, None]).astype(np.float32)
    return Asked(scene, Questions(points.astype(np.float32), below, share))


def _ours(scene: Scene, levels: Indices) -> Callable[[], None]:
    controls, times = scene.controls.astype("f4"), scene.times[:, None].astype("f4")

    def run() -> None:
        for level in np.unique(levels).tolist():
            rows = np.flatnonzero(levels == level)
            for first in range(0, len(rows), BATCH):
                part = rows[first : first + BATCH]
                scene.model.session.run(controls[part], times[part], *OUTPUTS, level=level)

    return run


def _naive(content: Contents, asked: Asked) -> dict[str, Answer]:
    made, field, questions = content.made, content.field, asked.questions
    return {
        SOLVED: crowd_frames.solved(made, field, questions),
        DUAL: crowd_frames.dual(made, field, questions),
        GATHERED: _graph(content.batch(), asked.scene),
        GATHERED_DUAL: _graph(content.batch_dual(), asked.scene),
    }


def _graph(content: bytes, scene: Scene) -> Answer:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    providers = ["CPUExecutionProvider"]
    session: Any = onnxruntime.InferenceSession(content, options, providers=providers)
    controls, times = scene.controls.astype("f4"), scene.times[:, None].astype("f4")

    def run() -> list[Singles]:
        parts = (slice(first, first + TOGETHER) for first in range(0, len(scene), TOGETHER))
        return [
            np.concatenate(
                [session.run(None, {"controls": controls[p], "time": times[p]})[0] for p in parts]
            )
        ]

    return run


def _scipy(made: Family, questions: Questions) -> Answer:
    values = naive_graphs.numbers(made, VECTORS)[..., 3:]
    samples = made.trained.model.bank.pose.samples
    field = RBFInterpolator(samples, values.reshape(len(values), -1), degree=1)
    means = made.trained.model.decoder.means.astype(np.float32)

    def run() -> list[Singles]:
        motions = field(questions.points).reshape(len(questions.points), *values.shape[1:])
        rows = np.arange(len(motions))
        before, after = (motions[rows, questions.below + more] for more in (0, 1))
        between = before + questions.share * (after - before)
        return [crowd_frames.decoded(between.astype(np.float32), means)]

    return run


def _check(content: Contents, asked: Asked) -> None:
    scene = asked.scene
    rivals = _naive(content, asked)
    naive_graphs.check(content, rivals, scene.controls, scene.times[:, None])
