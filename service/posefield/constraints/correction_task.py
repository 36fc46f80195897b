"""A motion to correct, and its constraints."""

from collections.abc import Sequence
from dataclasses import dataclass

from posefield.common.array_shapes import Variables
from posefield.constraints.constraint import Constraint
from posefield.constraints.motion_variables import MotionVariables


@dataclass(frozen=True)
class CorrectionTask:
    """A motion to correct. begun: numbers of the prediction. sigma: its standard deviation, m."""

    scene: MotionVariables
    sigma: float
    begun: Variables
    aims: Sequence[Constraint]

    @property
    def kind(self) -> tuple[object, ...]:
        """Return what tasks have in common that are solved at once."""
        kinds = tuple((aim.kind, len(aim.target)) for aim in self.aims)
        return kinds, len(self.begun), self.scene.predicted is None
