"""Plans of feet, and what they are made of: characters, sampled motions, and requests.

A plan lies on a grid of equal steps of time over the whole motion, so that it does not depend on
the frames that a question asks for. `body_plans` makes it, and `foot_placement` applies it to
frames.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from posefield.common.array_shapes import Bones, Frames, RootPath, Rotations
from posefield.common.units import Booleans, Floats
from posefield.feet import leads
from posefield.feet.ball_path import Footsteps
from posefield.feet.leads import Led
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stances import Cycle
from posefield.motion.foot_contacts import FootContact
from posefield.question.floor import LEVEL_FLOOR, Floor


@dataclass(frozen=True)
class Character:
    """Skeleton and limbs of a character.

    parents: of the joints. bones: offsets (J, 3), m. legs: of the feet that are planted. kept:
    limbs whose ends keep their predicted paths while they are led there, such as the arm of a hand
    with an exact target.
    fixed: whether the pelvis keeps its height above the floor. raised: whether a fixed one follows
    the floor nevertheless.
    """

    parents: tuple[int, ...]
    bones: Bones
    legs: tuple[Limb, ...]
    kept: tuple[Limb, ...] = ()
    fixed: bool = False
    raised: bool = False

    @property
    def limbs(self) -> tuple[Limb, ...]:
        """Return the legs, and the limbs that are kept."""
        return self.legs + self.kept


@dataclass(frozen=True)
class SampledMotion:
    """Poses of a whole motion at equal steps of time.

    rotations: (F, J, 4). roots: (F, 3), m. rate: frames a second. cycle: floor motion of a cycle,
    whose last frame is missing, as it is the first one of the next; None for other motions.
    walking: whether it walks in each frame (F,); None for a motion that is no walk.
    """

    rotations: Rotations
    roots: RootPath
    rate: float
    cycle: Cycle | None = None
    walking: Annotated[Booleans, "frames"] | None = None


@dataclass(frozen=True)
class FeetPlan:
    """Plan of the feet over the frames of a grid.

    rate: of the grid, frames a second. cycle: as of the motion. steps: of each leg. changes: of the
    path of each foot (K, F, 3), m. lowered: how much the root is lowered (F,), m. followed: the
    part of it that follows the floor (F,), m; the rest is the pelvis. grounded: how much a
    character that floats was lowered to the level on which it was captured, m. poses: predicted, of
    the limbs. led: what keeps its predicted path, and when. floor: on which the feet stand.
    unreached: legs, by place, none of whose stances reaches it.
    """

    character: Character
    rate: float
    cycle: Cycle | None
    steps: tuple[Footsteps, ...]
    changes: Annotated[Floats, "feet frames 3"]
    lowered: Frames
    followed: Frames
    grounded: float
    poses: LimbPoses
    led: Led
    floor: Floor = LEVEL_FLOOR
    unreached: tuple[int, ...] = ()


@dataclass(frozen=True)
class PlanRequest:
    """A motion whose feet are planned; any motion may be, also one that is joined of several.

    contacts: statistics of each leg's foot, with the probabilities `likely` (F, K) of its contacts;
    both are estimated from the motion if they are not given. floor: on which the feet stand. The
    steps are those of a floor at height 0, moved to it. A cycle does not climb: its floor must be
    level. led: what keeps its predicted path; the kept limbs all the time if not given. A foot is
    led over a level floor only.
    """

    character: Character
    motion: SampledMotion
    contacts: Sequence[FootContact] = ()
    likely: Annotated[Floats, "frames feet"] | None = None
    floor: Floor = LEVEL_FLOOR
    led: Led | None = None

    @property
    def leads(self) -> Led:
        """Return what keeps its predicted path."""
        body = self.character
        return self.led or leads.always(len(body.legs), len(body.kept), len(self.motion.roots))

    @property
    def kind(self) -> tuple[object, ...]:
        """Return what motions that are planned at once have in common."""
        body = self.character
        return body.parents, body.legs, body.kept, self.likely is None
