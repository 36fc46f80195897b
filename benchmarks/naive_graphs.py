"""Naive kriging as graphs that take the same questions and give the same answers as the model.

Timing, kinematic chart and decoding are the model's own, so that what differs is the method: how
pose vectors come out of controls.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from family import Family

from model_export import align, decoder
from model_export.naive import Naive
from model_export.net import Net
from service.motion import quat
from service.motion.conventions import Floats

ABOUT = {"producer_name": "posefield", "producer_version": "naive"}


def numbers(made: Family) -> Floats:
    """What naive kriging averages (N, T, 3 + 4 J): root positions, and rotation vectors turned
    beforehand as they are in the model, so that decoding costs both the same."""
    means = made.trained.model.decoder.means
    vectors = decoder.turned(means, made.vectors[..., 3:])
    return np.concatenate([made.vectors[..., :3], vectors], axis=-1)


def positions(made: Family) -> Floats:
    """Joint positions (N, T, J, 3) of the aligned clips, m."""
    return align.positions(made.trained.aligned, made.parents, made.offsets)


@dataclass(frozen=True)
class Contents:
    """Graphs of one naive field."""

    made: Family
    field: Naive

    def every_frame_once(self) -> bytes:
        """All frames' poses, then two of them for each time."""
        return self._graph(
            lambda net, points, place: self._rows(net, self.field.onnx(net, points), place)
        )

    def every_frame_once_dual(self) -> bytes:
        """The same through weights and samples multiplied beforehand."""
        return self._graph(
            lambda net, points, place: self._rows(net, self.field.onnx_dual(net, points), place)
        )

    def gathered(self) -> bytes:
        """Two frames' systems and samples for each time."""
        return self._graph(self._gathered)

    def _graph(self, poses: Callable[[Net, str, str], str]) -> bytes:
        model = self.made.trained.model
        net = Net()
        _, fields = model.bank.onnx(net, "controls")
        duration, place = model.timing.onnx(net, fields["duration"], fields["warp"], "time")
        points = model.bank.points_onnx(net, "controls")
        numbers = poses(net, points, net("Squeeze", place, net.indices(0, 2)))
        net.named("rotations", self._rotations(net, numbers))
        net.named(
            "root_position", net("Slice", numbers, net.indices(0), net.indices(3), net.indices(1))
        )
        net.named("bone_offsets", model.proportions.onnx(net, fields["offsets"]))
        net.named("duration", duration)
        joints = len(self.made.parents)
        return net.model(
            {"controls": [1, len(model.bank.low)], "time": [1, "steps"]},
            {
                "rotations": ["steps", joints, 4],
                "root_position": ["steps", 3],
                "bone_offsets": [1, joints, 3],
                "duration": [1],
            },
            {},
            ABOUT,
        )

    def _split(self, net: Net, place: str) -> tuple[str, str]:
        """Frame below (S,) and the share of the next one (S, 1)."""
        last = self.made.trained.model.timing.frames - 2.0
        before = net("Min", net("Floor", place), net.number(last))
        share = net("Unsqueeze", net("Sub", place, before), net.indices(1))
        return net("Cast", before, to=7), share

    def _between(self, net: Net, below: str, above: str, share: str) -> str:
        return net("Add", below, net("Mul", net("Sub", above, below), share))

    def _rows(self, net: Net, frames: str, place: str) -> str:
        """Pose vectors (S, D) between rows of those of all frames (T, D)."""
        row, share = self._split(net, place)
        after = net("Add", row, net.indices(1))
        return self._between(net, net("Gather", frames, row), net("Gather", frames, after), share)

    def _gathered(self, net: Net, points: str, place: str) -> str:
        row, share = self._split(net, place)
        after = net("Add", row, net.indices(1))
        return self._between(net, self._at(net, points, row), self._at(net, points, after), share)

    def _at(self, net: Net, points: str, row: str) -> str:
        """Pose vectors (S, D) of rows' own systems."""
        fields = self.field.fields
        basis = net("Gather", self.field.basis(net, points), row)
        inverse = np.stack([field.inverse[:, : len(field.samples)] for field in fields])
        weights = net("MatMul", basis, net("Gather", net.weights("inverses", inverse), row))
        samples = net.weights("values", self.field.values.transpose(1, 0, 2))
        return net("Squeeze", net("MatMul", weights, net("Gather", samples, row)), net.indices(1))

    def _rotations(self, net: Net, numbers: str) -> str:
        """Quaternions (S, J, 4) of numbers (S, 3 + 4 J), as the model's decoder makes them."""
        means = self.made.trained.model.decoder.means
        end = net.indices(3 + 4 * len(means))
        turned = net("Slice", numbers, net.indices(3), end, net.indices(1))
        return decoder.quaternions(net, net("Transpose", turned, perm=[1, 0]), means)


def check(
    made: Family,
    field: Naive,
    rivals: Mapping[str, Callable[[], list[Floats]]],
    point: Floats,
    times: Floats,
) -> None:
    """Refuse to time a rival that answers anything else than naive kriging does."""
    model = made.trained.model
    fields = model.bank.numpy(point)
    _, place = model.timing.numpy(fields["duration"], fields["warp"], times)
    frames = field.numpy(model.bank.points(point))[0]
    below = np.minimum(place[0].astype(int), len(frames) - 2)
    share = (place[0] - below)[:, None]
    numbers = (1.0 - share) * frames[below] + share * frames[below + 1]
    means = model.decoder.means
    halves = numbers[:, 3:].reshape(len(numbers), -1, 4)
    pure = quat.mul(quat.conj(means), halves)[..., 1:]
    expected = quat.mul(means, quat.exp(2.0 * pure))
    for name, rival in rivals.items():
        gap = float(np.abs(rival()[0] - expected).max())
        assert gap < 1e-3, f"{name} differs from naive kriging by {gap}"
