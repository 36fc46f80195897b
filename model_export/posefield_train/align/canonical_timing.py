"""Timing: from seconds to canonical time, with a duration and a warp per clip."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import ClipFrames, PerClip
from posefield.common.units import Floats
from posefield.model_file.row_values import ROW_VALUES
from posefield_train.align.warp import WarpBasis
from posefield_train.onnx_graph.graph_builder import GraphBuilder


@dataclass(frozen=True)
class CanonicalTiming:
    """Canonical frames 0 to frames - 1, and the basis of the warps to them."""

    basis: WarpBasis
    frames: int

    def numpy(
        self,
        log_duration: Annotated[Floats, "clips 1"],
        logs: Annotated[Floats, "clips knots"],
        time: ClipFrames,
    ) -> tuple[PerClip, ClipFrames]:
        """Return durations (B,), s, and canonical frames (B, S) at times (B, S), s.

        log_duration: (B, 1). logs: (B, knots). Times outside the clip are clamped to its ends.
        """
        durations = np.exp(log_duration[:, 0])
        u = np.clip(time / durations[:, None], 0.0, 1.0)
        return durations, (self.frames - 1) * self.basis.evaluate(logs, u)

    def onnx(self, net: GraphBuilder, log_duration: str, logs: str, time: str) -> tuple[str, str]:
        """Build durations (B, 1), s, and canonical frames (B, S)."""
        duration = net.rename_value(ROW_VALUES["duration"], net("Exp", log_duration))
        u = net("Clip", net("Div", time, duration), net.number(0.0), net.number(1.0))
        still = net.weights("warp_still", np.log(self.basis.identity))
        increments = net("Softmax", net("Add", logs, still), axis=1)
        # Scale to frames here, at no extra cost.
        form = net.weights("warp_form", (self.frames - 1) * self.basis.power_form)
        coefficients = net("Unsqueeze", net("Gemm", form, increments, transB=1), net.indices(2))
        # Powers lie outermost: a sum over them has the same order at every place of a row.
        terms = net("Mul", self._powers(net, u), coefficients)
        place = net("ReduceSum", terms, net.indices(0), keepdims=0)
        return duration, net("Clip", place, net.number(0.0), net.number(self.frames - 1.0))

    def _powers(self, net: GraphBuilder, u: str) -> str:
        """Build the functions (2 + pieces, B, S) of the warps' power form at shares (B, S).

        Each is a product of three factors: u times ones, u times u, or a hinge cubed.
        """
        breaks = np.concatenate([np.zeros(3), self.basis.breaks])[:, None, None]
        hinges = net("Sub", u, net.weights("warp_breaks", breaks))
        # No hinge exceeds one, and none of the first two is negative.
        least = np.zeros((2, len(breaks), 1, 1))
        least[0, :1], least[1, :2] = 1.0, 1.0
        second, third = (
            net("Max", hinges, net.weights(f"warp_factor_{i + 2}", least[i])) for i in range(2)
        )
        return net("Mul", net("Mul", net("Relu", hinges), second), third)
