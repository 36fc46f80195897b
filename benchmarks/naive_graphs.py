"""Naive kriging as graphs that take the same questions and give the same answers as the model.

Timing, kinematic chart and decoding are the model's own, so that what differs is the method: how
pose vectors come out of controls.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from family import Family
from paper import naive_kriging, variogram
from paper.naive_kriging import NaiveKriging

from posefield.common.units import Floats
from posefield.model_file import onnx_file
from posefield.motion import quat
from posefield.motion.quat import CHARTS, ChartName
from posefield_train.align import time_alignment
from posefield_train.kriging import kriging_graph
from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.onnx_graph import GraphBuilder, LevelTables
from posefield_train.tensor import decoder_graph

VECTORS: ChartName = "rotation_vector"
"""Chart of the paper, which naive kriging has but where it is said."""
ABOUT = {"producer_name": "posefield", "producer_version": "naive"}


def numbers(trained_family: Family, chart: ChartName) -> Floats:
    """Return the values (N, T, 3 + 4 J) that naive kriging averages: root positions, and the rows
    of rotations that are decoded, as in the model, so that decoding costs both the same."""
    chart_parameters = replace(trained_family.trained.tensor.chart, chart=chart)
    aligned = trained_family.trained.aligned
    vectors = chart_parameters.numbers(aligned.rotations, aligned.root_path)
    rows = decoder_graph.mean_products(chart_parameters, vectors[..., 3:])
    if chart == "stereographic":
        rows += chart_parameters.means.ravel()
    return np.concatenate([vectors[..., :3], rows], axis=-1)


def positions(trained_family: Family) -> Floats:
    """Joint positions (N, T, J, 3) of the aligned clips, m."""
    return time_alignment.joint_positions(
        trained_family.trained.aligned, trained_family.parents, trained_family.offsets
    )


@dataclass(frozen=True)
class Contents:
    """Graphs of one naive field, of numbers in a chart of rotations."""

    trained_family: Family
    field: NaiveKriging
    chart: ChartName

    def every_frame_once(self) -> bytes:
        """All frames' poses, then two of them for each time."""
        return self._graph(
            lambda net, points, frame_position: self._rows(
                net, self.field.onnx(net, points), frame_position
            )
        )

    def every_frame_once_dual(self) -> bytes:
        """The same through weights and samples multiplied beforehand."""
        return self._graph(
            lambda net, points, frame_position: self._rows(
                net, self.field.onnx_dual(net, points), frame_position
            )
        )

    def gathered(self) -> bytes:
        """Two frames' systems and samples for each time."""
        return self._graph(self._gathered)

    def batch(self) -> bytes:
        """For each question its own two frames' inverses and samples."""
        return self._graph(partial(self._own, self._weighed), alone=True)

    def batch_dual(self) -> bytes:
        """The same with inverse and samples multiplied beforehand."""
        return self._graph(partial(self._own, self._dual), alone=True)

    def _graph(self, poses: Callable[[GraphBuilder, str, str], str], alone: bool = False) -> bytes:
        """Graph of one question at many times, or of many questions at a time each."""
        model = self.trained_family.trained.model
        net = GraphBuilder()
        end_points = LevelTables(
            kriging_graph.entries(model.bank, [model.decoder.reduced.core.shape[2]])
        )
        fields = kriging_graph.onnx(model.bank, net, "controls", end_points.onnx(net))
        duration, frame_position = model.timing.onnx(
            net, fields["duration"], fields["warp"], "time"
        )
        points = self._points(net)
        axes = net.indices(1) if alone else net.indices(0)
        numbers = poses(net, points, net("Squeeze", frame_position, axes))
        root = net("Slice", numbers, net.indices(0), net.indices(3), net.indices(1))
        net.add_output("rotation_rows", self._rotations(net, numbers))
        net.add_output("root_rows", root)
        net.add_output("offset_rows", model.proportions.onnx(net, fields["offsets"]))
        net.add_output("durations", duration)
        joints, controls = len(self.trained_family.parents), len(model.bank.low)
        questions, times, answers = ("batch", 1, "batch") if alone else (1, "steps", "steps")
        model_graph = net.model(
            {"controls": [questions, controls], "time": [questions, times]},
            {
                "rotation_rows": [answers, 4 * joints],
                "root_rows": [answers, 3],
                "offset_rows": [questions, 3 * joints],
                "durations": [questions, 1],
            },
            {},
            ABOUT,
        )
        # Nodes that no output needs would be computed, too: those of our own poses and sigma.
        return onnx_file.select_outputs(
            model_graph, "rotation_rows", "root_rows", "offset_rows", "durations"
        )

    def _points(self, net: GraphBuilder) -> str:
        """The controls (B, d), whose sampled range is -1 to 1."""
        bank = self.trained_family.trained.model.bank
        gain = np.diag(2.0 / (bank.high - bank.low))
        shift = -(bank.high + bank.low) / (bank.high - bank.low)
        affine = net.weights("naive_gain", gain), net.weights("naive_shift", shift)
        return net("Gemm", "controls", *affine)

    def _own(
        self,
        poses: Callable[[GraphBuilder, str, str], str],
        net: GraphBuilder,
        points: str,
        frame_position: str,
    ) -> str:
        """Pose vectors (B, D) of each question's two frames, and a line between them."""
        row, share = self._split(net, frame_position)
        samples = self.field.fields[0].samples
        d = samples.shape[1]
        # |p - s|² as one product, as in ours: no array (B, n, d).
        both = net("Concat", net("Mul", points, points), points, axis=1)
        factors = net.weights(
            "naive_factors", np.vstack([np.ones_like(samples.T), -2.0 * samples.T])
        )
        squares = net.weights("naive_own", np.sum(np.square(samples), axis=1))
        squared = net("Max", net("Gemm", both, factors, squares), net.number(0.0))
        drift = net(
            "Gemm",
            points,
            net.weights("naive_drift", np.hstack([np.zeros((d, 1)), np.eye(d)])),
            net.weights("naive_one", np.eye(1, d + 1)[0]),
        )
        frames = (row, net("Add", row, net.indices(1)))
        frame_poses = (
            poses(net, self._system(net, squared, drift, frame), frame) for frame in frames
        )
        return self._between(net, *frame_poses, share)

    def _system(self, net: GraphBuilder, squared: str, drift: str, row: str) -> str:
        """Covariances and drift (B, 1, n + k) in the field of each question's frame."""
        fields = self.field.fields
        kind = COVARIANCES[fields[0].hyper.covariance]
        scales = kind.gain * np.array([field.hyper.scales[:1] ** 2 for field in fields])
        worth = net.weights("naive_worth", scales)
        covariance = kind.onnx(net, net("Mul", squared, net("Gather", worth, row)))
        return net("Unsqueeze", net("Concat", covariance, drift, axis=1), net.indices(1))

    def _dual(self, net: GraphBuilder, basis: str, row: str) -> str:
        duals = net.weights("duals", np.stack([field.dual for field in self.field.fields]))
        poses = net("MatMul", basis, net("Gather", duals, row))
        return net("Squeeze", poses, net.indices(1))

    def _split(self, net: GraphBuilder, frame_position: str) -> tuple[str, str]:
        """Frame below (S,) and the share of the next one (S, 1)."""
        last = self.trained_family.trained.model.timing.frames - 2.0
        before = net("Min", net("Floor", frame_position), net.number(last))
        share = net("Unsqueeze", net("Sub", frame_position, before), net.indices(1))
        return net("Cast", before, to=7), share

    def _between(self, net: GraphBuilder, below: str, above: str, share: str) -> str:
        return net("Add", below, net("Mul", net("Sub", above, below), share))

    def _rows(self, net: GraphBuilder, frames: str, frame_position: str) -> str:
        """Pose vectors (S, D) between rows of those of all frames (T, D)."""
        row, share = self._split(net, frame_position)
        after = net("Add", row, net.indices(1))
        return self._between(net, net("Gather", frames, row), net("Gather", frames, after), share)

    def _gathered(self, net: GraphBuilder, points: str, frame_position: str) -> str:
        row, share = self._split(net, frame_position)
        after = net("Add", row, net.indices(1))
        return self._between(net, self._at(net, points, row), self._at(net, points, after), share)

    def _at(self, net: GraphBuilder, points: str, row: str) -> str:
        """Pose vectors (S, D) of rows' own systems."""
        return self._weighed(net, net("Gather", self.field.basis(net, points), row), row)

    def _weighed(self, net: GraphBuilder, basis: str, row: str) -> str:
        """Averages (S, D) of the samples of rows, by weights from the rows' inverses."""
        fields = self.field.fields
        inverse = np.stack([field.weighing for field in fields])
        weights = net("MatMul", basis, net("Gather", net.weights("inverses", inverse), row))
        samples = net.weights("values", self.field.values.transpose(1, 0, 2))
        return net("Squeeze", net("MatMul", weights, net("Gather", samples, row)), net.indices(1))

    def _rotations(self, net: GraphBuilder, numbers: str) -> str:
        """Quaternions (S, 4 J) of numbers (S, 3 + 4 J), as the model's decoder makes them."""
        means = self.trained_family.trained.model.decoder.means
        end = net.indices(3 + 4 * len(means))
        turned = net("Slice", numbers, net.indices(3), end, net.indices(1))
        rows = net("Transpose", turned, perm=[1, 0])
        innermost = net.weights("naive_means", means[:, :, None])
        shape = net.indices(len(means), 1, -1)
        quaternions = decoder_graph.quaternions(net, self.chart, rows, innermost, shape)
        return decoder_graph.rows_of_poses(net, quaternions, len(means))


def fitted(trained_family: Family, chart: ChartName) -> Contents:
    """Return the graphs of a naive field, fitted frame by frame to numbers in a chart."""
    samples = trained_family.trained.model.bank.pose.samples
    values = positions(trained_family), numbers(trained_family, chart)
    field = naive_kriging.fit_naive(samples, *values, "matern52", variogram.fit_by_grid)
    return Contents(trained_family, field, chart)


def check(
    content: Contents,
    rivals: Mapping[str, Callable[[], list[Floats]]],
    controls: Floats,
    times: Floats,
) -> None:
    """Refuse to time a rival that answers anything else than naive kriging does.

    controls (B, d) and times (B, S): the rivals' answers have B and S as one axis.
    """
    model, field, chart = content.trained_family.trained.model, content.field, CHARTS[content.chart]
    # The procedural family's performers are not told apart.
    points = model.bank.points(controls, np.zeros((len(controls), 0)))
    fields = model.bank.numpy(points)
    _, frame_position = model.timing.numpy(fields["duration"], fields["warp"], times)
    frames = field.numpy(points)
    below = np.minimum(frame_position.astype(int), frames.shape[1] - 2)
    share = (frame_position - below)[..., None]
    which = np.arange(len(frames))[:, None]
    numbers = (1.0 - share) * frames[which, below] + share * frames[which, below + 1]
    means = model.decoder.means
    rows = numbers[..., 3:].reshape(-1, len(means), 4)
    pure = quat.mul(quat.conj(means), rows)[..., 1:]
    expected = quat.mul(means, chart.quaternions(pure / chart.share))
    for name, rival in rivals.items():
        gap = float(np.abs(rival()[0].reshape(expected.shape) - expected).max())
        assert gap < 1e-3, f"{name} differs from naive kriging by {gap}"
