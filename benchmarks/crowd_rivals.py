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


def rows(trained_family: Family, model: Synthesizer) -> list[Row]:
    """Ours, at levels by view and at the finest, against every rival."""
    content = naive_graphs.fitted(trained_family, VECTORS)
    _check(content, _asked(trained_family, crowd_scene.around(model, CHECKED)))
    question = _asked(trained_family, crowd_scene.around(model, MANY))
    few = _asked(trained_family, crowd_scene.around(model, FEW))
    levels = question.scene.poses(AUTO)().levels
    runs = {
        "auto": _ours(question.scene, levels),
        "finest": _ours(question.scene, np.zeros_like(levels)),
        **_naive(content, question),
    }
    timings = in_turn(runs, rounds=9, repeats=1)
    scipys = (
        in_turn({"scipy": _scipy(trained_family, few.questions)}, rounds=5, repeats=1)["scipy"]
        * MANY
        / FEW
    )
    return [_row(name, {**timings, SCIPY: scipys}) for name in [*list(runs)[2:], SCIPY]]


def _row(name: str, timings: dict[str, float]) -> Row:
    ratio = timings[name] / timings["auto"]
    finest = f"ours all at the finest: {1e3 * timings['finest']:.3g} ms"
    words = f"{name}: {1e3 * timings[name]:.3g} ms; {finest}"
    title = f"crowd of {MANY:,}, levels by view, graph alone on one thread"
    return Row(title, 1e3 * timings["auto"], "ms", words, ratio, None)


def _asked(trained_family: Family, scene: Scene) -> Asked:
    model = trained_family.trained.model
    # The procedural family's performers are not told apart.
    points = model.bank.points(scene.controls, np.zeros((len(scene), 0)))
    fields = model.bank.numpy(points)
    _, frame_position = model.timing.numpy(fields["duration"], fields["warp"], scene.times[:, None])
    below = np.minimum(frame_position[:, 0].astype(int), model.timing.frames - 2)
    share = (frame_position - below[:, None]).astype(np.float32)
    return Asked(scene, Questions(points.astype(np.float32), below, share))


def _ours(scene: Scene, levels: Indices) -> Callable[[], None]:
    controls, times = scene.controls.astype("f4"), scene.times[:, None].astype("f4")

    def run() -> None:
        for level in np.unique(levels).tolist():
            rows = np.flatnonzero(levels == level)
            for first in range(0, len(rows), BATCH):
                chunk = rows[first : first + BATCH]
                scene.model.session.run(controls[chunk], times[chunk], *OUTPUTS, level=level)

    return run


def _naive(content: Contents, question: Asked) -> dict[str, Answer]:
    trained_family, field, questions = content.trained_family, content.field, question.questions
    return {
        SOLVED: crowd_frames.solved(trained_family, field, questions),
        DUAL: crowd_frames.dual(trained_family, field, questions),
        GATHERED: _graph(content.batch(), question.scene),
        GATHERED_DUAL: _graph(content.batch_dual(), question.scene),
    }


def _graph(content: bytes, scene: Scene) -> Answer:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    providers = ["CPUExecutionProvider"]
    session: Any = onnxruntime.InferenceSession(content, options, providers=providers)
    controls, times = scene.controls.astype("f4"), scene.times[:, None].astype("f4")

    def run() -> list[Singles]:
        slices = (slice(first, first + TOGETHER) for first in range(0, len(scene), TOGETHER))
        return [
            np.concatenate(
                [session.run(None, {"controls": controls[p], "time": times[p]})[0] for p in slices]
            )
        ]

    return run


def _scipy(trained_family: Family, questions: Questions) -> Answer:
    values = naive_graphs.numbers(trained_family, VECTORS)[..., 3:]
    samples = trained_family.trained.model.bank.pose.samples
    field = RBFInterpolator(samples, values.reshape(len(values), -1), degree=1)
    means = trained_family.trained.model.decoder.means.astype(np.float32)

    def run() -> list[Singles]:
        motions = field(questions.points).reshape(len(questions.points), *values.shape[1:])
        rows = np.arange(len(motions))
        before, after = (motions[rows, questions.below + more] for more in (0, 1))
        between = before + questions.share * (after - before)
        return [crowd_frames.decoded(between.astype(np.float32), means)]

    return run


def _check(content: Contents, question: Asked) -> None:
    scene = question.scene
    rivals = _naive(content, question)
    naive_graphs.check(content, rivals, scene.controls, scene.times[:, None])
