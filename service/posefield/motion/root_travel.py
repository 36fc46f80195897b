"""Root travel of a cycle, added back to its poses."""

from typing import Annotated

from posefield.common.units import UP, Floats
from posefield.motion import quat


def add_travel(
    rotations: Annotated[Floats, "*poses joints 4"],
    roots: Annotated[Floats, "*poses 3"],
    gone: Annotated[Floats, "*poses 3"],
) -> tuple[Annotated[Floats, "*poses joints 4"], Annotated[Floats, "*poses 3"]]:
    """Return rotations (..., J, 4) and root positions (..., 3), m, moved by a travel (..., 3).

    gone: travel to the left and ahead, m, and change of heading, rad.
    """
    turned = rotations.copy()
    turned[..., 0, :] = quat.mul(quat.from_axis_angle(UP, gone[..., 2]), rotations[..., 0, :])
    return turned, moved_roots(roots, gone)


def moved_roots(
    roots: Annotated[Floats, "*poses 3"], gone: Annotated[Floats, "*poses 3"]
) -> Annotated[Floats, "*poses 3"]:
    """Return root positions (..., 3), m, moved by the travel over the floor in (..., 3)."""
    moved = roots.copy()
    moved[..., [0, 2]] += gone[..., :2]
    return moved
