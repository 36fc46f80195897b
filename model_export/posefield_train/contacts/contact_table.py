"""Contact labels of all clips, reduced to a few functions of canonical time.

The label of a clip is linear in its coefficients. Kriging these with the parameters of the pose
gives the sum of the clips' labels weighted as the clips' poses are: indicator kriging (Journel
1983). Clipped to 0 to 1, the sum is a probability.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import ClipFrames, Floats
from posefield.motion import quat
from posefield_train.kriging import coefficient_models
from posefield_train.onnx_graph.graph_builder import GraphBuilder

LEAST_COLUMNS, MOST_COLUMNS = 6, 10
"""Numbers of functions, where there are as many clips."""
KEPT_VARIATION = 0.95
"""Share of the squared labels that the functions keep, where MOST_COLUMNS suffice."""


@dataclass(frozen=True)
class ContactTable:
    """Functions of canonical time whose sums are contact labels. values: (r, K, T)."""

    values: Annotated[Floats, "modes joints frames"]

    def numpy(
        self, coefficients: Annotated[Floats, "clips modes"], place: ClipFrames
    ) -> Annotated[Floats, "clips frames joints"]:
        """Return probabilities (B, S, K) of contacts at canonical frames (B, S).

        coefficients: (B, r). As for poses, the functions are interpolated linearly between frames.
        """
        rows = quat.interpolate_rows(self._rows, place).reshape(*place.shape, *self._shape)
        return np.clip(np.einsum("bskr,br->bsk", rows, coefficients), 0.0, 1.0)

    def labels(
        self, coefficients: Annotated[Floats, "clips modes"]
    ) -> Annotated[Floats, "clips frames joints"]:
        """Return the labels (N, T, K) of coefficients (N, r), not clipped."""
        return np.einsum("rkt,nr->ntk", self.values, coefficients)

    def onnx(self, net: GraphBuilder, coefficients: str, place: str) -> str:
        """Build `numpy` in a graph, from canonical frames (B, S)."""
        table, last = net.weights("contact_table", self.values), self.values.shape[2] - 1
        zero, one, time = net.indices(0), net.indices(1), net.indices(2)
        first = net("Slice", table, zero, net.indices(last), time)
        steps = net("Sub", net("Slice", table, one, net.indices(last + 1), time), first)
        before = net("Min", net("Floor", place), net.number(last - 1.0))
        column = net("Cast", before, to=6)
        rise = net("Mul", net("Gather", steps, column, axis=2), net("Sub", place, before))
        functions = net("Add", net("Gather", first, column, axis=2), rise)
        # (r, 1, B, 1) beside functions (r, K, B, S).
        weights = net("Unsqueeze", net("Transpose", coefficients, perm=[1, 0]), net.indices(1, 3))
        sums = net("ReduceSum", net("Mul", functions, weights), zero, keepdims=0)
        shares = net("Clip", sums, net.number(0.0), net.number(1.0))
        return net("Transpose", shares, perm=[1, 2, 0])

    @property
    def _shape(self) -> tuple[int, int]:
        modes, joints, _ = self.values.shape
        return joints, modes

    @property
    def _rows(self) -> Annotated[Floats, "frames values"]:
        """Return the functions as rows (T, K r)."""
        return self.values.transpose(2, 1, 0).reshape(self.values.shape[2], -1)


def reduce_labels(
    labels: Annotated[Floats, "clips frames joints"],
) -> tuple[ContactTable, Annotated[Floats, "clips modes"]]:
    """Return the functions of labels (N, T, K) and each clip's coefficients (N, r).

    Singular value decomposition over clips, of the labels as they are: the first function is near
    their mean.
    """
    clips, frames, joints = labels.shape
    rows = labels.transpose(0, 2, 1).reshape(clips, -1)
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    squares = np.cumsum(np.square(sizes))
    enough = 1 + int(np.searchsorted(squares, KEPT_VARIATION * squares[-1]))
    rank = min(max(enough, LEAST_COLUMNS), MOST_COLUMNS, len(sizes))
    signs = coefficient_models.row_signs(right[:rank])
    functions = (signs[:, None] * right[:rank]).reshape(rank, joints, frames)
    return ContactTable(functions), left[:, :rank] * sizes[:rank] * signs
