"""Complete model in float64, the reference for the graph."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats
from posefield.model_file import checked_file
from posefield.model_file.model_card import ROW_VALUES
from posefield.motion import skeleton
from posefield.motion.curves import Curve, as_points
from posefield_train.align.travel import Travel
from posefield_train.align.warp import CanonicalTiming
from posefield_train.contacts.contact_model import ContactTable
from posefield_train.kriging import kriging_graph
from posefield_train.kriging.kriging_bank import POSE, VARIANCE, KrigingBank
from posefield_train.onnx_graph import GraphBuilder, LevelTables, Shapes
from posefield_train.tensor import decoder_graph
from posefield_train.tensor.decoder import Decoder, Proportions


@dataclass(frozen=True)
class ModelOutputs:
    """Outputs of a model.

    rotations: (B, S, J, 4). root_position: (B, S, 3), m. bone_offsets: (B, J, 3), m. duration:
    (B,), s. sigma: (B,), m. travel: (B, S, 3). curves: values (B, S, C); None for a model without
    curves. contacts: probabilities (B, S, K); None for a model without contacts.
    """

    rotations: Floats
    root_position: Floats
    bone_offsets: Floats
    duration: Floats
    sigma: Floats
    travel: Floats
    curves: Floats | None = None
    contacts: Floats | None = None

    def positions(self, parents: tuple[int, ...]) -> Floats:
        """Return joint positions (B, S, J, 3), m."""
        translations = skeleton.translations(self.bone_offsets, self.root_position)
        return skeleton.positions(parents, self.rotations, translations)

    def points(self, parents: tuple[int, ...], curves: tuple[Curve, ...]) -> Floats:
        """Return joint positions and, behind them, the points of curves (B, S, J + C, 3), m."""
        joints = self.positions(parents)
        if self.curves is None:
            return joints
        return np.concatenate([joints, as_points(curves, self.curves)], axis=-2)


@dataclass(frozen=True)
class FloatModel:
    """Stages of a trained model.

    travel: None if it is not cyclic. contacts: None without contacts; `bank.contacts` gives their
    coefficients.
    """

    bank: KrigingBank
    timing: CanonicalTiming
    decoder: Decoder
    proportions: Proportions
    travel: Travel | None
    contacts: ContactTable | None = None

    def evaluate(
        self, controls: Floats, time: Floats, labels: Floats | None = None, level: int = 0
    ) -> ModelOutputs:
        """Return outputs at controls (B, d) in their own units and times (B, S), s, of a level.

        labels: weights (B, p) of names, by default none of any label set.
        """
        none = np.zeros((len(controls), self.bank.label_count))
        fields = self.fields(controls, none if labels is None else labels, level)
        outputs = self.outputs_at_times(fields, time, level)
        if self.contacts is None or self.bank.contacts is None:
            return outputs
        points = self.bank.points(controls, none if labels is None else labels)
        _, frames = self.timing.numpy(fields["duration"], fields["warp"], time)
        contacts = self.contacts.numpy(self.bank.contacts.predict(points), frames)
        return replace(outputs, contacts=contacts)

    def fields(self, controls: Floats, labels: Floats, level: int) -> dict[str, Floats]:
        """Return the values (B, m) of all kriged quantities by name."""
        return self.bank.numpy(self.bank.points(controls, labels), level)

    def outputs_at_times(self, fields: dict[str, Floats], time: Floats, level: int) -> ModelOutputs:
        """Return the outputs for `fields` at times (B, S), s."""
        _, frames = self.timing.numpy(fields["duration"], fields["warp"], time)
        return self._decode(fields, frames, level)

    def durations(self, controls: Floats, labels: Floats) -> Floats:
        """Return the durations (B,), s, at the finest level."""
        return self.bank.durations(self.bank.points(controls, labels))

    def outputs_at_frames(
        self, controls: Floats, frames: Floats, labels: Floats, level: int
    ) -> ModelOutputs:
        """Return outputs at canonical frames (B, S)."""
        return self._decode(self.fields(controls, labels, level), frames, level)

    def joint_at_frame(
        self, fields: dict[str, Floats], chain: Sequence[int], frame: int, level: int
    ) -> Floats:
        """Return the positions (B, 3), m, of the last joint of a chain at one canonical frame.

        chain: joints from the root on, each the parent of the next.
        """
        decoder = self.decoder.at_level(level).select_joints(chain)
        rotations, root = (values[:, None] for values in decoder.at_frame(fields[POSE], frame))
        if self.travel:
            frames = np.full((len(root), 1), float(frame))
            rotations, root, _ = self.travel.numpy(rotations, root, fields["travel"], frames)
        offsets = self.proportions.numpy(fields["offsets"])[:, list(chain)]
        translations = skeleton.translations(offsets, root)
        parents = tuple(range(-1, len(chain) - 1))
        return skeleton.positions(parents, rotations, translations)[:, 0, -1]

    def _decode(self, fields: dict[str, Floats], frames: Floats, level: int) -> ModelOutputs:
        decoder = self.decoder.at_level(level)
        rotations, root = decoder.numpy(fields[POSE], frames)
        gone, duration = np.zeros((*frames.shape, 3)), np.exp(fields["duration"][:, 0])
        if self.travel:
            rotations, root, gone = self.travel.numpy(rotations, root, fields["travel"], frames)
        offsets = self.proportions.numpy(fields["offsets"])
        sigma = self.bank.sigma(fields[VARIANCE])
        curves = decoder.curve_values(fields[POSE], frames) if decoder.curves else None
        return ModelOutputs(rotations, root, offsets, duration, sigma, gone, curves)

    def onnx(self, metadata: dict[str, str], about: dict[str, str]) -> bytes:
        """Return the file of the model: one graph with metadata, producer fields and a checksum."""
        net = GraphBuilder()
        ranks = [size.ranks[2] for size in self.decoder.level_sizes]
        ladder = LevelTables(
            {**kriging_graph.entries(self.bank, ranks), **decoder_graph.entries(self.decoder)}
        )
        tables = ladder.onnx(net)
        fields = kriging_graph.onnx(self.bank, net, "controls", tables)
        # service/posefield/constraints reads the coefficients by this name.
        fields[POSE] = net.rename_value("coefficients", fields[POSE])
        duration, frames = self.timing.onnx(net, fields["duration"], fields["warp"], "time")
        frames = net.rename_value("frame", frames)
        decoded = decoder_graph.onnx(self.decoder, net, fields[POSE], frames, tables)
        planes, root = decoded.planes, decoded.root
        if self.travel:
            coefficients = net.rename_value("way", fields["travel"])
            planes, root, gone = self.travel.onnx(net, planes, root, coefficients, frames)
        joints = len(self.decoder.means)
        rows = {
            "rotations": decoder_graph.rows_of_poses(net, planes, joints),
            "root_position": root,
            "bone_offsets": self.proportions.onnx(net, fields["offsets"]),
            "duration": duration,
            "sigma": fields["sigma"],
        }
        if decoded.curves:
            rows["curves"] = decoded.curves
        # The service reads the rows, whose shape it knows.
        rows = {name: net.rename_value(ROW_VALUES[name], value) for name, value in rows.items()}
        # A difference of equal numbers costs less than a product with three zeros per pose.
        still = gone if self.travel else net("Sub", rows["root_position"], rows["root_position"])
        rows["travel"] = net.rename_value(ROW_VALUES["travel"], still)
        self._add_outputs(net, rows, frames)
        if self.contacts and self.bank.contacts:
            # Built last, so that a graph pruned of them is the graph of a model without them.
            field = self.bank.contacts
            contact_coefficients = kriging_graph.contact_coefficients(
                self.bank, field, net, "controls"
            )
            net.add_output("contacts", self.contacts.onnx(net, contact_coefficients, frames))
        inputs: Shapes = {"controls": ["batch", len(self.bank.low)], "time": ["batch", "steps"]}
        if self.bank.labels:
            # Its default has one row, so its axis must not share the name "batch".
            inputs["labels"] = ["batch_or_one", self.bank.label_count]
        inputs["level"] = []
        outputs: Shapes = {
            "rotations": ["batch", "steps", joints, 4],
            "root_position": ["batch", "steps", 3],
            "bone_offsets": ["batch", joints, 3],
            "duration": ["batch"],
            "sigma": ["batch"],
            "travel": ["batch", "steps", 3],
        }
        if self.decoder.curves:
            outputs["curves"] = ["batch", "steps", len(self.decoder.curves)]
        if self.contacts:
            outputs["contacts"] = ["batch", "steps", self.contacts.values.shape[1]]
        return checked_file.append_checksum(net.model(inputs, outputs, metadata, about))

    def _add_outputs(self, net: GraphBuilder, rows: dict[str, str], frames: str) -> None:
        """Add the outputs in their shapes, from rows by output; frames: canonical frames (B, S)."""
        sizes = net("Shape", frames)
        first = net.weights("first", np.array(0))
        axes = {"rotations": (len(self.decoder.means), 4), "root_position": (3,), "travel": (3,)}
        if self.decoder.curves:
            axes["curves"] = (len(self.decoder.curves),)
        for name, value in rows.items():
            if name in axes:
                shape = net("Concat", sizes, net.indices(*axes[name]), axis=0)
                net.add_output(name, net("Reshape", value, shape))
            elif name == "bone_offsets":
                shape = net.indices(-1, len(self.decoder.means), 3)
                net.add_output(name, net("Reshape", value, shape))
            else:
                net.add_output(name, net("Gather", value, first, axis=1))
