"""A model in use: its name and version, and facts that crowds and answers share."""

from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import blake2b

import numpy as np

from posefield.common.array_shapes import Vector
from posefield.inference import cost_model
from posefield.inference.level_selection import LevelTable
from posefield.inference.session import Session
from posefield.motion import joint_roles
from posefield.motion.joint_roles import NamingConvention
from posefield.motion.skeleton import Skeleton


@dataclass(frozen=True)
class NamedModel:
    """An opened model file and the name under which it is asked."""

    name: str
    session: Session

    @cached_property
    def identity(self) -> str:
        """name@contenthash; answers under this name never change."""
        return f"{self.name}@{self.session.digest}"

    @cached_property
    def fingerprint(self) -> bytes:
        """Digest of the model file and of this machine's rounding.

        It differs between machines on which the model's answers or the correction differ in the
        last digits.
        """
        parts = self.identity.encode() + self.session.golden + rounding_fingerprint()
        return blake2b(parts, digest_size=16).digest()

    @cached_property
    def level_table(self) -> LevelTable:
        """Errors and costs of the levels of detail, from which a view chooses.

        An error is that of the worst measured pose. Costs are measured on first use.
        """
        errors = np.array([level.pose for level in self.session.card.levels])
        return LevelTable(errors, np.array(cost_model.seconds_per_pose(self.session)))

    @property
    def rest_position(self) -> Vector:
        """Root position at rest (3,), m."""
        return self.session.card.skeleton.offsets[0]

    @cached_property
    def radius(self) -> float:
        """Radius, m, of a sphere about the root that contains the body at rest."""
        joints = self.session.card.skeleton
        rest = joints.at_rest(joints.offsets)
        return float(np.linalg.norm(rest - rest[0], axis=-1).max())

    @cached_property
    def _skeletons(self) -> dict[NamingConvention, Skeleton]:
        """Cache of skeletons by naming convention."""
        return {"own": self.session.card.skeleton}

    def skeleton(self, names: NamingConvention) -> Skeleton:
        """Return the skeleton with these names; InvalidField if the model has no roles for them."""
        card = self.session.card
        if names not in self._skeletons:
            self._skeletons[names] = joint_roles.rename_joints(card.skeleton, card.roles, names)
        return self._skeletons[names]


# Sizes that are no multiple of a register, so that remainders are covered.
ROWS, COLUMNS = 29, 37


@cache
def rounding_fingerprint() -> bytes:
    """Return a matrix product, a solution and sines of fixed numbers as bytes.

    They differ between processors whose rounding differs.
    """
    numbers = np.sin(np.arange(1.0, ROWS * COLUMNS + 1.0)).reshape(ROWS, COLUMNS)
    square = numbers @ numbers.T + np.eye(ROWS)
    return b"".join(a.tobytes() for a in (square, np.linalg.solve(square, numbers), numbers))
