"""Sections of a recipe on its data: files, table, and the conversion of clips to a tensor."""

from typing import Annotated, Literal

from pydantic import Field

from posefield.common.units import UpAxis
from posefield.motion.joint_roles import Role
from posefield_train.source.recipe_sections.control_sources import Name, RecipePart, Text
from posefield_train.source.rigs.facing import Facing

PERFORMER = "performer"
"""Label set whose column is clips.performer."""
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Source(RecipePart):
    """Unit, axes and rate of the motion files.

    A file that states another one, as USD and glTF do, is an error.
    """

    metres_per_unit: Positive = Field(description="length of one unit of the files, m")
    up: UpAxis = Field(description="the files' up axis; their frame is right-handed")
    root_offset: Literal["replace", "add"] | None = Field(
        default=None,
        description="whether root position channels replace the root's OFFSET or add to it; "
        "default: replace, with a note if the OFFSET is not zero",
    )
    rate: Annotated[float, Field(ge=1, le=10_000, allow_inf_nan=False)] | None = Field(
        default=None,
        description="frames a second: needed for AMC files, which state none, and for USD and glTF "
        "files whose keys are not one a frame: their curves are sampled at it; a BVH file of "
        "another rate is an error",
    )


class Condition(RecipePart):
    """Selection of rows of the table, by listed values or by a range of a number."""

    among: list[str] | None = Field(
        default=None, description="accept rows whose cell is one of these texts"
    )
    without: list[str] | None = Field(
        default=None, description="accept rows whose cell is none of these texts"
    )
    minimum: float | None = Field(default=None, description="smallest accepted number")
    maximum: float | None = Field(default=None, description="largest accepted number")


class Clips(RecipePart):
    """Location of the table and the meaning of its columns."""

    table: Text = Field(
        description="CSV file, relative to the data folder, or to the recipe's folder if the data "
        "folder has none of that name"
    )
    file: Text = Field(description="column: motion file, relative to the table")
    animation: Text | None = Field(
        default=None,
        description="column: animation of a USD or glTF file that holds several, by name or path; "
        "an empty cell for a file with one",
    )
    performer: Text | None = Field(default=None, description="column: performer")
    labels: dict[Name, Text] = Field(
        default={},
        description="columns: names of further label sets, such as { style = 'style' }, for "
        "kriging.label",
    )
    take: Text | None = Field(
        default=None,
        description="column: take, unique among the performer's; clips of one take are left out "
        "together; default: clips of one file are, and clips that share frames, mirror or continue "
        "each other",
    )
    first_frame: Text | None = Field(default=None, description="column: first frame, from 0")
    last_frame: Text | None = Field(default=None, description="column: last frame, inclusive")
    landmarks: list[Text] = Field(
        default=[],
        description="columns: frames of events, in order, counted from 0 as in the motion file, "
        "that alignment moves to the same time in all clips; such as ['contact_frame']",
    )
    where: dict[str, Condition] = Field(default={}, description="conditions on rows, by column")


class SkeletonSettings(RecipePart):
    """Topology of the skeleton."""

    topology: Literal["files", "roles"] = Field(
        default="files",
        description="files: all clips have the joints of their files, which must be equal; roles: "
        "clips of different skeletons become one of people, with the joints of the roles that all "
        "have, the longest common chains of spine and neck, one rest pose and their own "
        "proportions. Joints are then named by their roles: hips, spine1, neck1, leftHand",
    )
    roles: dict[Role, Text | Annotated[list[Text], Field(min_length=1)]] = Field(
        default={},
        description="joints of the files by role, for topology = 'roles': one name, or a list of "
        "which each file has at most one; default: recognised by names and structure",
    )

    @property
    def is_unified(self) -> bool:
        """Return whether clips are brought onto the topology of roles."""
        return self.topology == "roles"

    @property
    def stated(self) -> dict[str, list[str]]:
        """Return the stated joints by role."""
        return {
            str(role): [names] if isinstance(names, str) else names
            for role, names in self.roles.items()
        }


class Motion(RecipePart):
    """Conversion of clips to a tensor."""

    frames: Annotated[int, Field(ge=8, le=1000)] = Field(
        description="number of aligned frames per clip, T"
    )
    cyclic: bool = Field(description="whether the last pose leads into the first")
    root: Literal["travelling", "in_place"] = Field(
        description="in_place removes the straight line of the root's horizontal travel"
    )
    drop_joints: list[Text] = Field(
        default=[], description="joints to omit, with all their descendants"
    )
    joint_weights: dict[str, Positive] = Field(
        default={}, description="weight of a joint's position in the metric; default: 1"
    )
    feet: list[Text] = Field(
        default=[],
        description="joints of the feet, best the balls: for the contacts with the ground and the "
        "measurement of foot skate",
    )
    end_sites: list[Text] = Field(
        default=[],
        description="end sites of the motion files that become joints of the model, for targets: "
        "each is named as its joint with the ending _end, such as 'LeftToes_end'; those that the "
        "recipe names elsewhere need not be listed",
    )
    facing: Facing | None = Field(
        default=None,
        description="horizontal axis of the root along which the body faces at rest (y up); or "
        "measured: travel, from the way of the clips; hips, from the line between the upper legs; "
        "roles, the same by [roles] only; or none, for a hand or a prop; default: +z; a facing "
        "that the motion contradicts is an error",
    )
    bones: Literal["rigid", "stretch"] = Field(
        default="rigid",
        description="rigid refuses clips with bones that stretch by more than 0.6 % of the body's "
        "size, 1 cm of an adult; stretch keeps the mean of each bone, with a note",
    )
