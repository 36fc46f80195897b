"""Level-dependent integers of the graph, selected by its input `level`."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from posefield_train.onnx_graph.graph_builder import GraphBuilder

Integers = Sequence[int]


@dataclass(frozen=True)
class LevelTables:
    """Lists of integers by name, one list per level, the finest first.

    They are slice ends and shapes: every weight of a coarser level is a leading part of the finest
    one's, except for the thinned kriging weights.
    """

    entries: dict[str, list[Integers]]

    def onnx(self, net: GraphBuilder) -> dict[str, str]:
        """Build the chosen level's lists by name.

        `level` is an optional input of the graph; its default is zero, the finest level.
        """
        level = net.weights("level", np.array(0))
        rows = [list(chain(*lists)) for lists in zip(*self.entries.values(), strict=True)]
        table = net.weights("ladder", np.array(rows))
        sizes = [len(lists[0]) for lists in self.entries.values()]
        parts = net.multi_output(
            "Split", len(sizes), net("Gather", table, level), net.indices(*sizes)
        )
        return dict(zip(self.entries, parts, strict=True))
