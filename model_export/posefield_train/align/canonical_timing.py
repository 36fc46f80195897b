"""Timing: from seconds to canonical time, with a duration and a warp per clip."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import ClipFrames, PerClip
from posefield.common.units import Floats
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
        """Build durations (B,), s, and canonical frames (B, S, 1)."""
        duration = net("Exp", log_duration)
        share = net("Unsqueeze", net("Div", time, duration), net.indices(2))
        u = net("Clip", share, net.number(0.0), net.number(1.0))
        breaks = np.concatenate([[0.0], self.basis.breaks])
        hinges = net("Relu", net("Sub", u, net.weights("warp_breaks", breaks)))
        cubes = net("Mul", net("Mul", hinges, hinges), hinges)
        powers = net("Concat", u, net("Mul", u, u), cubes, axis=2)
        still = net.weights("warp_still", np.log(self.basis.identity))
        increments = net("Softmax", net("Add", logs, still), axis=1)
        # Scale to frames here, at no extra cost.
        form = (self.frames - 1) * self.basis.power_form.T
        coefficients = net("MatMul", increments, net.weights("warp_form", form))
        # A small matrix product per clip would take longer than product and sum.
        terms = net("Mul", powers, net("Unsqueeze", coefficients, net.indices(1)))
        pairs = net.weights("warp_pairs", np.ones((len(form.T), 2)))
        place = net.row_sums(terms, pairs)
        end = net.number(self.frames - 1.0)
        return (
            net("Squeeze", duration, net.indices(1)),
            net("Clip", place, net.number(0.0), end),
        )
