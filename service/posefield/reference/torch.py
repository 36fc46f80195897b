"""Reference motions of a robot in torch: batched, differentiable, on any device.

reference = ReferenceMotion("gaits.onnx", device="cuda")
goal = reference.sample(commands, phase)      # commands (E, d), phase (E,)
reward = torch.exp(-(joints - goal.joint_positions).square().sum(-1))
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from posefield.reference.motion_plan import Arrays, Evaluator, Plan, Reference, ReferenceModel

ROWS = 256
"""Commands that are planned at once: more take more memory, and no less time."""


class ReferenceMotion(Evaluator):
    """Reference motions of a robot's model, by commands and phase.

    device, dtype: of the tensors that are taken and returned. Cycles are predicted in double
    precision, or in `dtype` on a device that lacks it; feet are solved in `dtype`. labels: name by
    label set, such as a style. Raises ModelError for a file that is no robot's gaits.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        device: torch.device | str = "cpu",
        dtype: torch.dtype = torch.float32,
        labels: Mapping[str, Any] | None = None,
    ) -> None:
        device = torch.device(device)
        double = dtype if device.type == "mps" else torch.float64
        model = ReferenceModel(path, labels)
        self._double, self._dtype = double, dtype
        self._planned = torch.empty(0, len(model.controls), dtype=dtype, device=device)
        self._plan: Plan | None = None
        super().__init__(model, *(_arrays(device, precision) for precision in (double, dtype)))

    def plan(self, commands: torch.Tensor) -> Plan:
        """Return the cycles of commands (E, d), in the units and order of `controls`."""
        blocks = map(super().plan, commands.to(self._double).split(ROWS))
        return Plan(*(torch.cat(values).to(self._dtype) for values in zip(*blocks, strict=True)))

    def sample(self, commands: torch.Tensor | Plan, phase: torch.Tensor) -> Reference:
        """Return the reference for commands (E, d), or their plan, at phases (E,), in cycles.

        Commands are remembered, and those that are the same as in the call before are not planned
        again. Gradients pass to commands that require them, whose plans are not remembered, and to
        phases.
        """
        if isinstance(commands, Plan):
            return super().sample(commands, phase)
        if commands.requires_grad and torch.is_grad_enabled():
            return super().sample(self.plan(commands), phase)
        with torch.no_grad():
            plan = self._remembered(commands.detach())
        return super().sample(plan, phase)

    def _remembered(self, commands: torch.Tensor) -> Plan:
        if self._plan is None or commands.shape != self._planned.shape:
            self._plan, self._planned = self.plan(commands), commands.clone()
            return self._plan
        changed = (commands != self._planned).any(-1).nonzero()[:, 0]
        if len(changed):
            self._planned[changed] = commands[changed]
            for values, fresh in zip(self._plan, self.plan(commands[changed]), strict=True):
                values[changed] = fresh
        return self._plan


def _arrays(device: torch.device, dtype: torch.dtype) -> Arrays:
    return Arrays(
        torch,
        lambda values: torch.as_tensor(values, dtype=dtype, device=device),
        lambda values: values.long(),
        lambda values, indices: values.index_select(0, indices),
    )
