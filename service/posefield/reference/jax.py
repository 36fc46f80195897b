"""Reference motions of a robot in JAX: batched, differentiable, and compiled.

reference = ReferenceMotion("gaits.onnx")
plan = reference.plan(commands)               # commands (E, d), planned when they change
goal = reference.sample(plan, phase)          # phase (E,)
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

from posefield.reference.motion_plan import Arrays, Evaluator, Plan, Reference, ReferenceModel


class ReferenceMotion(Evaluator):
    """Reference motions of a robot's model, by commands and phase.

    dtype: of the arrays, on JAX's default device; double precision needs `jax_enable_x64`. labels:
    name by label set, such as a style. Raises ModelError for a file that is no robot's gaits.

    Both methods are pure and compiled; inside `jax.jit` they become part of it.
    """

    def __init__(
        self, path: str | Path, *, dtype: Any = jnp.float32, labels: Mapping[str, Any] | None = None
    ) -> None:
        model = ReferenceModel(path, labels)
        arrays = Arrays(
            jnp,
            partial(jnp.asarray, dtype=dtype),
            lambda values: values.astype(jnp.int32),
            lambda values, indices: values[indices],
        )
        super().__init__(model, arrays, arrays)
        self._compiled = jax.jit(super().plan), jax.jit(super().sample)

    def plan(self, commands: Any) -> Plan:
        """Return the cycles of commands (E, d), in the units and order of `controls`."""
        plan: Plan = self._compiled[0](commands)
        return plan

    def sample(self, commands: Any, phase: Any) -> Reference:
        """Return the reference for commands (E, d), or their plan, at phases (E,), in cycles."""
        plan = commands if isinstance(commands, Plan) else self.plan(commands)
        reference: Reference = self._compiled[1](plan, phase)
        return reference
