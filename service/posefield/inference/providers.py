"""Execution providers of onnxruntime: what computes the graph, in calls of which sizes."""

import os
from collections.abc import Mapping
from dataclasses import dataclass

from posefield.common.errors import InvalidField

VARIABLE = "POSEFIELD_PROVIDER"
"""Environment variable that names the provider."""
TOLERANCE = 1e-4
"""Largest difference of answers between providers: of a joint's position in m, of a quaternion's
numbers, of a duration in s.
"""
SIGMA_TOLERANCE = 1e-3
"""Largest difference of sigma between providers, m: the root of a difference of like numbers."""


@dataclass(frozen=True)
class CallSizes:
    """Rows of one call of the graph; a row of a crowd is one character at one time.

    fewest, most: rows of a call for a crowd. count: number of calls to aim for in between. walking:
    most rows of a call for strides of walking characters. timed: rows of the calls by which levels
    of detail are timed.
    """

    fewest: int
    most: int
    count: int
    walking: int
    timed: int

    def rows_per_call(self, rows: int) -> int:
        """Return the most rows of each call for a crowd of so many rows."""
        return min(max(rows // self.count, self.fewest), self.most)


@dataclass(frozen=True)
class Provider:
    """A row of the table of providers.

    name: value of the setting. execution: onnxruntime's name of the provider. device: onnxruntime's
    name of its memory. calls: sizes of calls. smallest: rows from which on a call runs there, while
    the CPU computes smaller ones; None for the CPU itself. options: onnxruntime's options.
    """

    name: str
    execution: str
    device: str
    calls: CallSizes
    smallest: int | None = None
    options: tuple[tuple[str, str], ...] = ()


# Smaller calls are dominated by their overhead and that of threads; larger ones exceed a core's
# cache between operators, and a pose of a walk costs up to eight times as much. The number of calls
# is fixed, not the number of cores: rounding depends on it.
CPU = Provider(
    "cpu", "CPUExecutionProvider", "cpu", CallSizes(512, 1536, 8, walking=1000, timed=512)
)
CUDA = Provider(
    "cuda",
    "CUDAExecutionProvider",
    "cuda",
    CallSizes(65_536, 65_536, 1, walking=65_536, timed=65_536),
    smallest=2048,
    options=(
        # TF32 keeps 10 of the 23 bits of a product's factors: answers would be off by millimetres.
        ("use_tf32", "0"),
        # Each session has an arena; the default doubles it whenever it is full.
        ("arena_extend_strategy", "kSameAsRequested"),
    ),
)
PROVIDERS = {each.name: each for each in (CPU, CUDA)}
"""Providers by the value of the setting."""


def find_provider(name: str) -> Provider:
    """Return the provider of this name; InvalidField for an unknown one."""
    if name not in PROVIDERS:
        raise InvalidField(VARIABLE, f"{name!r}, expected {' or '.join(PROVIDERS)}")
    return PROVIDERS[name]


def chosen_provider(environ: Mapping[str, str] = os.environ) -> Provider:
    """Return the provider that the environment names, else the CPU; InvalidField if unknown."""
    return find_provider(environ.get(VARIABLE, CPU.name))
