"""The levels of detail as a graph sees them: rows of whole numbers, of which `level` picks one."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from model_export.net import Net

Numbers = Sequence[int]


@dataclass(frozen=True)
class Ladder:
    """Lists of whole numbers by name, one for each level, the finest first.

    They are ends of slices, and shapes: every weight of a coarser level is the leading part of the
    finest one's, but for what kriging was thinned to.
    """

    entries: dict[str, list[Numbers]]

    def onnx(self, net: Net) -> dict[str, str]:
        """The chosen level's lists by name.

        `level` is a constant that a caller may feed another value for: zero, and so the finest.
        """
        level = net.weights("level", np.array(0))
        rows = [list(chain(*lists)) for lists in zip(*self.entries.values(), strict=True)]
        table = net.weights("ladder", np.array(rows))
        sizes = [len(lists[0]) for lists in self.entries.values()]
        parts = net.many("Split", len(sizes), net("Gather", table, level), net.indices(*sizes))
        return dict(zip(self.entries, parts, strict=True))
