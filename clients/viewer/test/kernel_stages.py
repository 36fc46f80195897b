"""Values of the graph's stages at random questions, as JSON; kernel.page.ts compares the kernel's.

    kernel_stages.py MODEL COUNT

Stages are found in the graph by their neighbours with names, so that others may change.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx

from posefield.common.units import Floats
from posefield.inference import onnx_runtime, session
from posefield.inference.session import Session
from posefield.kriging.covariance import COVARIANCE_MODELS, KERNEL_GAINS
from posefield.model_file import subgraph
from posefield.motion import skeleton


class Graph:
    """Graph of a model file: producers and consumers of its values."""

    def __init__(self, content: bytes) -> None:
        self.nodes = list(onnx.load_from_string(content).graph.node)

    def producer(self, value: str) -> onnx.NodeProto:
        """Return the node that computes a value."""
        return next(node for node in self.nodes if value in node.output)

    def consumer(self, value: str, operator: str) -> onnx.NodeProto:
        """Return the first node of an operator that reads a value."""
        return next(n for n in self.nodes if n.op_type == operator and value in n.input)

    def stages(self) -> dict[str, str]:
        """Return the names of the values of the kernel's stages, by stage."""
        values = self.producer("coefficients").input[0]
        found = {"values": values, "basis": self.producer(values).input[0]}
        own = self.consumer("coefficients", "Gemm").output[0]
        motion = self.consumer(own, "Reshape").output[0]
        product = self.consumer(motion, "MatMul")
        moves = self.consumer(product.output[0], "Reshape").output[0]
        root, turned = (n.output[0] for n in self.nodes if n.op_type == "Gemm" and moves in n.input)
        return found | {
            "motion": motion,
            "time": product.input[0],
            "moves": product.output[0],
            "root": root,
            "turned": turned,
            "duration": "duration",
            "frame": "frame",
            "quaternions": "rotations",
            "bones": "bone_offsets",
            "place": "root_position",
        }


def questions(own: Session, count: int) -> tuple[Floats, Floats, Floats]:
    """Return random controls (N, d), weights of labels (N, p) and times (N, 1), s."""
    random = np.random.default_rng(5)
    low, high = own.card.sampled_ranges
    controls = random.uniform(low, high, (count, len(low))).astype(np.float32)
    labels = np.zeros((count, sum(len(each.names) for each in own.card.labels)), np.float32)
    start = 0
    for each in own.card.labels:
        names = random.integers(0, len(each.names), (count, 2)) + start
        # Some have one name, some two of which a part is left open, some none.
        for row, kind in enumerate(random.integers(0, 3, count)):
            labels[row, names[row, :kind]] = 1.0 if kind == 1 else 0.4
        start += len(each.names)
    shares = random.uniform(-0.05, 1.05, (count, 1))
    asked = {"labels": labels} if own.card.labels else {}
    times = shares * own.durations(controls, **asked)[:, None]
    return controls, labels, times.astype(np.float32)


def evaluate(own: Session, level: int, asked: tuple[Floats, Floats, Floats]) -> dict[str, Any]:
    """Return the values of the stages (N, ...) at a level, with one graph call for each row."""
    names = Graph(own.content).stages()
    outputs = list(dict.fromkeys(names.values()))
    graph = subgraph.select_outputs(subgraph.fix_level(own.content, level), *outputs)
    running = onnx_runtime.open_session(graph, own.card.name)
    rows = []
    for controls, labels, times in zip(*asked, strict=True):
        feed = {"controls": controls[None], "time": times[None]}
        feed |= {"labels": labels[None]} if own.card.labels else {}
        found = dict(zip(outputs, running.run(outputs, feed), strict=True))
        rows.append(stages({stage: found[name] for stage, name in names.items()}, own))
    return {stage: np.array([row[stage] for row in rows]).tolist() for stage in rows[0]}


def answered(own: Session, level: int, asked: tuple[Floats, Floats, Floats]) -> list[Any]:
    """Return the positions (N, 3 J), m, of the joints in the service's answers at a level."""
    controls, labels, times = asked
    outputs = ("rotations", "root_position", "bone_offsets")
    found = own.run(controls, times, *outputs, labels=labels, level=level)
    translations = skeleton.translations(found[2], found[1])
    places = skeleton.positions(own.card.skeleton.parents, found[0], translations)
    return list(places.reshape(len(controls), -1).tolist())


def stages(found: dict[str, npt.NDArray[Any]], own: Session) -> dict[str, Floats]:
    """Return the kernel's stages, flat, from those of the graph."""
    rotations, bones = found["quaternions"][0, 0], found["bones"][0].copy()
    bones[0] = found["place"][0, 0]
    turned = found["turned"].ravel()
    if own.card.making.chart == "stereographic":
        # The graph adds the mean rotations beforehand.
        turned = turned - subgraph.initializers(own.content)["mean_rotations"].ravel()
    kept = ("basis", "motion", "time", "moves", "duration", "frame")
    places = skeleton.positions(own.card.skeleton.parents, rotations, bones)
    return {
        **{name: found[name].ravel() for name in kept},
        # The first is the logarithm of the variance.
        "values": found["values"].ravel()[1:],
        "numbers": np.concatenate([found["root"].ravel(), turned]),
        "quaternions": rotations.ravel(),
        "bones": bones.ravel(),
        "places": places.ravel(),
    }


def covariances() -> dict[str, list[float]]:
    """Return the covariances at the squared scaled distances 0, 1/16, 2/16 ... below 4."""
    squares = np.arange(64) / 16.0
    return {
        name: formula(squares / KERNEL_GAINS[name]).tolist()
        for name, formula in COVARIANCE_MODELS.items()
    }


def main(model: str, count: int) -> None:
    """Write the questions, and the stages by level."""
    own = session.load(Path(model))
    asked = questions(own, count)
    levels = [evaluate(own, level, asked) for level in range(len(own.card.levels))]
    answers = [answered(own, level, asked) for level in range(len(own.card.levels))]
    controls, labels, times = (each.tolist() for each in asked)
    said = {"controls": controls, "labels": labels, "times": times}
    said |= {"levels": levels, "answers": answers, "covariances": covariances()}
    json.dump(said, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
