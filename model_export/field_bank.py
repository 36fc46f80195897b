"""From controls to everything that is kriged, in one evaluation.

Pose coefficients, bone offsets, duration and time warp are fields over the same samples, each with
scales and a nugget of its own. A field that the controls do not explain is its mean.
"""

from dataclasses import dataclass

import numpy as np

from model_export.covariance import COVARIANCES
from model_export.kriging import Kriging
from model_export.net import Net
from service.motion.conventions import Floats


@dataclass(frozen=True)
class Constant:
    """A field (m,) that does not depend on the controls."""

    mean: Floats

    def predict(self, points: Floats) -> Floats:
        """Values (B, m) at points (B, d)."""
        return np.repeat(self.mean[None], len(points), axis=0)


Field = Kriging | Constant


def half_ranges(controls: Floats, low: Floats, high: Floats) -> Floats:
    """Controls (B, d) on a scale where the range from low to high (d,) is -1 to 1."""
    return (2.0 * controls - low - high) / (high - low)


@dataclass(frozen=True)
class FieldBank:
    """Fields by name, the pose's first, over controls whose sampled ranges are low to high (d,).

    performers: who is told apart, in the order of their labels.
    """

    low: Floats
    high: Floats
    performers: tuple[str, ...]
    pose: Kriging
    others: dict[str, Field]

    @property
    def fields(self) -> dict[str, Field]:
        """All fields, in the order in which the graph holds them."""
        return {"pose": self.pose, **self.others}

    @property
    def kriged(self) -> list[Kriging]:
        """The fields that depend on the controls, in order."""
        return [field for field in self.fields.values() if isinstance(field, Kriging)]

    def points(self, controls: Floats, labels: Floats) -> Floats:
        """Points (B, d + p) of controls (B, d), whose sampled range is -1 to 1, and labels."""
        return np.hstack([half_ranges(controls, self.low, self.high), labels])

    def points_onnx(self, net: Net, controls: str) -> str:
        """The same in a graph."""
        return net(
            "Gemm",
            controls,
            net.weights("control_gain", np.diag(2.0 / (self.high - self.low))),
            net.weights("control_shift", -(self.high + self.low) / (self.high - self.low)),
        )

    def numpy(self, points: Floats) -> dict[str, Floats]:
        """Values (B, m) of each field at points (B, d + p)."""
        return {name: field.predict(points) for name, field in self.fields.items()}

    def onnx(self, net: Net, controls: str) -> tuple[str, dict[str, str]]:
        """Basis (B, d + F n), points first and the pose's covariances next, and the fields.

        Where performers are told apart, `performer` (B or 1, p) says who moves by their labels. It
        is a constant that a caller may feed another value for: zeros, and so nobody that was seen.
        """
        points = self.points_onnx(net, controls)
        basis = net("Concat", points, self._covariances(net, points), axis=1)
        bias = np.concatenate([_constant_part(field) for field in self.fields.values()])
        values = net("Gemm", basis, self._duals(net), net.weights("field_bias", bias))
        sizes = [len(_constant_part(field)) for field in self.fields.values()]
        parts = net.many("Split", len(sizes), values, net.indices(*sizes), axis=1)
        return basis, dict(zip(self.fields, parts, strict=True))

    def _covariances(self, net: Net, points: str) -> str:
        """Covariances (B, F n) of every field with every sample.

        Squared distances come from one product with [p², p]: no array (B, n, d) is ever made. Its
        factors follow from samples and scales when the session loads, and are not stored.
        """
        d, n = len(self.low), len(self.pose.samples)
        scales = np.stack([field.hyper.scales for field in self.kriged])
        worth = net.weights("squared_scales", np.square(scales)[:, :, None])
        samples = net.weights("samples", self.pose.samples[:, :d].T[None])
        cross = net("Mul", net("Mul", worth, samples), net.number(-2.0))
        squares = net("Mul", net("Mul", samples, samples), worth)
        own = net("ReduceSum", squares, net.indices(1), keepdims=0)
        size = len(self.kriged) * n
        factors = net(
            "Concat",
            self._columns(net, net("Expand", worth, net.indices(len(scales), d, n)), d, size),
            self._columns(net, cross, d, size),
            axis=0,
        )
        both = net("Concat", net("Mul", points, points), points, axis=1)
        constant = net("Reshape", own, net.indices(size))
        if self.performers:
            constant = self._apart(net, constant, size)
        squared = net("Gemm", both, factors, constant)
        name = self.pose.hyper.covariance
        # A distance of zero comes out a rounding error below it, where a root has no value.
        return COVARIANCES[name].onnx(net, net("Max", squared, net.number(1e-12)))

    def _apart(self, net: Net, own: str, size: int) -> str:
        """What of the squared distances does not hang on the controls (B or 1, F n): `own` (F n),
        and label² (1 - q·e) of each field for labels q of who moves and e of a sample.
        """
        p, n, fields = len(self.performers), len(self.pose.samples), len(self.kriged)
        labels = np.square([field.hyper.label for field in self.kriged])
        apart = net.weights("squared_labels", labels[:, None, None])
        whose = net.weights("whose", np.argmax(self.pose.samples[:, len(self.low) :], axis=1))
        states = net.weights("states", np.array([0.0, 1.0]))
        same = net("OneHot", whose, net.indices(p), states, axis=0)
        nearer = self._columns(net, net("Mul", apart, same), p, size)
        everyone = net("Expand", apart, net.indices(fields, 1, n))
        farthest = net("Add", own, net("Reshape", everyone, net.indices(size)))
        performer = net.weights("performer", np.zeros((1, p)))
        return net("Gemm", performer, nearer, farthest, alpha=-1.0)

    @staticmethod
    def _columns(net: Net, stacked: str, d: int, size: int) -> str:
        """Fields' blocks (F, d, n) side by side (d, F n)."""
        return net("Reshape", net("Transpose", stacked, perm=[1, 0, 2]), net.indices(d, size))

    def _duals(self, net: Net) -> str:
        """Weights (d + F n, M) with each field's own block, put together when the session loads."""
        linear = np.hstack([_linear_part(f, len(self.low)) for f in self.fields.values()])
        total, start, blocks = linear.shape[1], 0, [net.weights("drift_weights", linear)]
        for name, field in self.fields.items():
            width = len(_constant_part(field))
            if isinstance(field, Kriging):
                own = net.weights(f"{name}_weights", field.dual[: len(field.samples)])
                around = net.indices(0, start, 0, total - start - width)
                blocks.append(net("Pad", own, around))
            start += width
        return net("Concat", *blocks, axis=0)


def _constant_part(field: Field) -> Floats:
    return field.mean if isinstance(field, Constant) else field.dual[len(field.samples)]


def _linear_part(field: Field, controls: int) -> Floats:
    """Weights (d, m) of the controls themselves: zero where the drift has none."""
    if isinstance(field, Kriging) and max(field.hyper.drifts):
        return field.dual[len(field.samples) + 1 :]
    return np.zeros((controls, len(_constant_part(field))))


@dataclass(frozen=True)
class Spread:
    """How far a captured clip lies from the predicted one: kriging variance and nugget, in metres.

    sill: of the pose field, m² a joint and frame.
    """

    pose: Kriging
    sill: float

    def numpy(self, points: Floats) -> Floats:
        """Standard deviation (B,) at points (B, d) in half-ranges, m."""
        variance = self.pose.variance(points) + self.pose.hyper.nugget
        return np.sqrt(self.sill * np.maximum(variance, 0.0))

    def onnx(self, net: Net, basis: str) -> str:
        """The same (B,) of the bank's basis."""
        n, d = len(self.pose.samples), len(self.pose.hyper.scales)
        drift = max(self.pose.hyper.drifts) * d
        # The bank's basis is [points, covariances], the system's [covariances, 1, points].
        order = [*range(n + 1, n + 1 + drift), *range(n)]
        matrix = self.pose.form[np.ix_(order, order)]
        own = net(
            "Slice",
            basis,
            net.indices(d - drift),
            net.indices(d + n),
            net.indices(1),
        )
        linear = 2.0 * self.pose.form[n, order]
        product = net(
            "Gemm", own, net.weights("precision", -matrix), net.weights("precision_1", -linear)
        )
        falling = net("ReduceSum", net("Mul", product, own), net.indices(1), keepdims=0)
        rest = 1.0 + self.pose.hyper.nugget - float(self.pose.form[n, n])
        variance = net("Relu", net("Add", falling, net.number(rest)))
        return net("Sqrt", net("Mul", variance, net.number(self.sill)))
