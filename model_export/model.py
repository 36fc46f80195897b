"""The whole model in float64: what the graph must answer, stage by stage."""

from dataclasses import dataclass

import numpy as np

from model_export import field_graph
from model_export.decoder import Decoder, Proportions
from model_export.field_bank import POSE, VARIANCE, FieldBank
from model_export.ladder import Ladder
from model_export.net import Net, Shapes
from model_export.timing import Timing
from model_export.travel import Travel
from service.motion import skeleton
from service.motion.conventions import Floats


@dataclass(frozen=True)
class Outputs:
    """rotations (B, S, J, 4), root_position (B, S, 3), bone_offsets (B, J, 3), duration (B,),
    sigma (B,), travel (B, S, 3)."""

    rotations: Floats
    root_position: Floats
    bone_offsets: Floats
    duration: Floats
    sigma: Floats
    travel: Floats

    def positions(self, parents: tuple[int, ...]) -> Floats:
        """Joint positions (B, S, J, 3), m."""
        translations = skeleton.translations(self.bone_offsets, self.root_position)
        return skeleton.forward(parents, self.rotations, translations)[0]


@dataclass(frozen=True)
class Model:
    """The stages of a trained model; only that of a cycle travels apart from its poses."""

    bank: FieldBank
    timing: Timing
    decoder: Decoder
    proportions: Proportions
    travel: Travel | None

    def evaluate(
        self, controls: Floats, time: Floats, labels: Floats | None = None, level: int = 0
    ) -> Outputs:
        """Answer to controls (B, d) in their own units and times (B, S), s, at a level of detail.

        labels (B, p): who moves; nobody that was seen, if not said.
        """
        nobody = np.zeros((len(controls), len(self.bank.performers)))
        points = self.bank.points(controls, nobody if labels is None else labels)
        fields = self.bank.numpy(points, level)
        _, place = self.timing.numpy(fields["duration"], fields["warp"], time)
        return self._decoded(fields, place, level)

    def posed(self, controls: Floats, place: Floats, labels: Floats, level: int) -> Outputs:
        """The same at canonical frames (B, S)."""
        fields = self.bank.numpy(self.bank.points(controls, labels), level)
        return self._decoded(fields, place, level)

    def _decoded(self, fields: dict[str, Floats], place: Floats, level: int) -> Outputs:
        rotations, root = self.decoder.at(level).numpy(fields[POSE], place)
        gone, duration = np.zeros((*place.shape, 3)), np.exp(fields["duration"][:, 0])
        if self.travel:
            rotations, root, gone = self.travel.numpy(rotations, root, fields["travel"], place)
        offsets = self.proportions.numpy(fields["offsets"])
        sigma = self.bank.sigma(fields[VARIANCE])
        return Outputs(rotations, root, offsets, duration, sigma, gone)

    def onnx(self, metadata: dict[str, str], about: dict[str, str]) -> bytes:
        """The same as one graph, with metadata and what the file says of its producer."""
        net = Net()
        ranks = [rung.ranks[2] for rung in self.decoder.rungs]
        ladder = Ladder({**field_graph.entries(self.bank, ranks), **self.decoder.entries()})
        ends = ladder.onnx(net)
        fields = field_graph.onnx(self.bank, net, "controls", ends)
        # What exact controls start from: service/synthesis/exact.
        fields[POSE] = net.called("coefficients", fields[POSE])
        duration, place = self.timing.onnx(net, fields["duration"], fields["warp"], "time")
        place = net.called("frame", place)
        rotations, root = self.decoder.onnx(net, fields[POSE], place, ends)
        if self.travel:
            way = net.called("way", fields["travel"])
            rotations, root, gone = self.travel.onnx(net, rotations, root, way, place)
        else:
            gone = net("Mul", place, net.weights("no_travel", np.zeros(3)))
        net.named("rotations", rotations)
        net.named("root_position", root)
        net.named("bone_offsets", self.proportions.onnx(net, fields["offsets"]))
        net.named("duration", duration)
        net.named("sigma", fields["sigma"])
        net.named("travel", gone)
        joints = len(self.decoder.means)
        inputs: Shapes = {"controls": ["batch", len(self.bank.low)], "time": ["batch", "steps"]}
        if self.bank.performers:
            # Its default is one row: a name for both would promise the runtime what is not so.
            inputs["performer"] = ["batch_or_one", len(self.bank.performers)]
        inputs["level"] = []
        outputs: Shapes = {
            "rotations": ["batch", "steps", joints, 4],
            "root_position": ["batch", "steps", 3],
            "bone_offsets": ["batch", joints, 3],
            "duration": ["batch"],
            "sigma": ["batch"],
            "travel": ["batch", "steps", 3],
        }
        return net.model(inputs, outputs, metadata, about)
