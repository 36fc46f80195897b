"""Sections of a recipe on its data and on the training."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import (
    ConfigDict,
    Field,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from posefield.common.units import UpAxis
from posefield.motion.joint_roles import Role
from posefield.robots.file_conventions import QuaternionOrder
from posefield.robots.robot import Order
from posefield_train.source.control_sources import TIME_NAMES, Name, RecipePart, Text
from posefield_train.source.facing import Facing

PERFORMER = "performer"
"""Label set whose column is clips.performer."""
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Source(RecipePart):
    """Unit, axes and rate of the motion files.

    They overrule what a file states, as USD and glTF do, with a note.
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
        "files whose keys are not one a frame: their curves are sampled at it; it overrules the "
        "frame time of BVH files, with a note",
    )


class RobotSource(RecipePart):
    """Robot whose reference motions the files hold, and their conventions.

    The files have metres and Z up, and the model Y up; the robot faces +Z.
    """

    model: Text = Field(
        description="MJCF or URDF file of the robot, relative to the data folder; "
        "its bodies are the joints"
    )
    quaternions: QuaternionOrder | None = Field(
        default=None, description="order of the base's quaternions, where the numbers do not tell"
    )
    order: Order | None = Field(
        default=None, description="order of joints without names, where the bodies do not tell"
    )
    degrees: bool = Field(default=False, description="whether the files give angles in degrees")


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
    recording: Text | None = Field(
        default=None,
        description="column: recording, unique among the performer's; clips of one are left out "
        "together; default: clips of one file are, and clips that share frames, mirror or continue "
        "each other. It was called take, a name that is accepted for one version, with a note",
    )
    first_frame: Text | None = Field(default=None, description="column: first frame, from 0")
    last_frame: Text | None = Field(default=None, description="column: last frame, inclusive")
    landmarks: list[Text] = Field(
        default=[],
        description="columns: frames of events, in order, counted from 0 as in the motion file, "
        "that alignment moves to the same time in all clips; such as ['contact_frame']",
    )
    where: dict[str, Condition] = Field(default={}, description="conditions on rows, by column")

    @model_serializer(mode="wrap")
    def _write_former_key(
        self, write: SerializerFunctionWrapHandler, info: SerializationInfo
    ) -> dict[str, Any]:
        fields = write(self)
        if info.by_alias:
            return fields
        # The digest of a recipe on its model's card is that of the keys' first names.
        return {("take" if key == "recording" else key): fields[key] for key in fields}


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


FiniteNumber = Annotated[float, Field(allow_inf_nan=False)]


class Alignment(RecipePart):
    """Time warping."""

    knots: Annotated[int, Field(ge=3, le=24)] = Field(
        default=6, description="number of free increments of a time warp; few knots avoid jerk"
    )
    rounds: Annotated[int, Field(ge=0, le=8)] = Field(
        default=2, description="number of re-alignments after the alignment to the medoid"
    )
    warp: Literal["fitted", "identity"] = Field(
        default="fitted",
        description="fitted: the pace of each clip is aligned with the others; identity: clips are "
        "compared at equal shares of their durations, for cycles that are in step as they are, "
        "such as those of a program",
    )
    reference: Literal["prediction", "mean"] = Field(
        default="prediction",
        description="reference of the re-alignments: the prediction for a clip, or the mean clip",
    )
    begin: Literal["in_phase", "as_cut"] = Field(
        default="as_cut",
        description="start of a cyclic clip: as_cut at its first frame, or in_phase at the "
        "family's common phase, for cycles that were cut at arbitrary phases",
    )


class Kriging(RecipePart):
    """Kriging model of the control coefficients."""

    covariance: Literal[
        "matern52", "matern32", "gaussian", "exponential", "spherical", "chosen"
    ] = Field(
        default="chosen",
        description="covariance of motions as a function of distance; chosen selects gaussian if "
        "its leave-one-out error is more than 5 % below that of matern52, else matern52",
    )
    drift: Literal[0, 1, "chosen"] = Field(
        default="chosen",
        description="polynomial degree of the drift; chosen puts a linear trend into the "
        "covariance, as strong as the leave-one-out error finds best: from none, as degree 0, to "
        "free, as degree 1",
    )
    nugget: Annotated[float, Field(ge=0, le=10)] | None = Field(
        default=None, description="nugget as a share of the sill; default: fitted by leave-one-out"
    )
    label: list[Text] = Field(
        default=[],
        description="label sets of clips besides their controls: 'performer' and names of "
        "clips.labels. The names of each set have offsets of their own, and their motions a "
        "correlation. One set may be given as a text",
    )

    @field_validator("label", mode="before", json_schema_input_type=Text | list[Text])
    @classmethod
    def _read_one_label(cls, label: object) -> object:
        return [label] if isinstance(label, str) else label

    @field_validator("label")
    @classmethod
    def _check_labels(cls, labels: list[str]) -> list[str]:
        if len(set(labels)) < len(labels):
            raise ValueError(f"found {labels}, expected each label set once")
        return labels

    @property
    def degree(self) -> int:
        """Return the degree of the drift; a trend within the covariance needs a constant only."""
        return self.fixed_degree or 0

    @property
    def fixed_degree(self) -> Literal[0, 1] | None:
        """Return the degree that the recipe asks for; None for a trend in the covariance."""
        return None if self.drift == "chosen" else self.drift

    @property
    def covariances(self) -> tuple[str, ...]:
        """Return the covariances that are tried."""
        return ("matern52", "gaussian") if self.covariance == "chosen" else (self.covariance,)


FOUND_MOMENTS = tuple(name for name in TIME_NAMES if name not in ("start", "end"))
"""Moments of an event that are found in the motion, and differ from clip to clip."""


class Event(RecipePart):
    """Event of a motion: a joint and the moment at which its position matters."""

    joint: Text = Field(description="joint of the event: a hand that reaches, a foot that lands")
    at: Text = Field(
        description="moment of the event: 'start', 'end', 'highest', 'lowest' or 'farthest' (from "
        "the root) of its joint, or a column of clips.landmarks such as 'contact_frame'; all but "
        "start and end are aligned to one time in all clips"
    )

    @property
    def is_found(self) -> bool:
        """Return True if the moment is found in each clip, as a landmark that needs no column."""
        return self.at in FOUND_MOMENTS


class Contacts(RecipePart):
    """Contacts from the table of clips, in place of detected ones."""

    columns: dict[Text, Text] = Field(
        default={},
        description="columns: intervals of contact of a joint, such as { RightHand = 'hand_on' }; "
        "a cell has frames of the motion file from 0, first and last, as '12-40 77-90'. A foot of "
        "motion.feet that is not listed is detected; any other joint, such as a hand on a thing, "
        "has contacts only if it is listed",
    )


class Detail(RecipePart):
    """Level of detail below the model's own size."""

    times: Annotated[float, Field(gt=1, allow_inf_nan=False)] = Field(
        description="factor on the budgets, or on the errors at the given ranks, for this level"
    )
    drop_joints: list[Text] = Field(
        default=[],
        description="joints that do not move, with all their descendants; their error does not "
        "count against the budgets",
    )


# An image 1080 pixels high, with a horizontal field of view of 60 degrees, resolves 1 cm at 15 m.
DEFAULT_LEVELS = (Detail(times=2.0), Detail(times=4.0), Detail(times=8.0))


class Size(RecipePart):
    """Size of the truncated tensor: ranks, or error budgets.

    Errors are true distances between joints, by forward kinematics; all given budgets apply.
    """

    levels: list[Detail] | None = Field(
        default=None,
        description="coarser levels of detail, each coarser than the one before; default: three "
        "levels of 2, 4 and 8 times the budgets",
    )

    ranks: (
        Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=3, max_length=3)] | None
    ) = Field(default=None, description="ranks of degrees of freedom, frames and samples")
    rms_budget_cm: Positive | None = Field(
        default=None, description="limit of the root-mean-square joint distance, cm"
    )
    p99_budget_cm: Positive | None = Field(
        default=None,
        description="limit of the 99th percentile of the joint distances over joints, frames and "
        "clips, cm",
    )
    effector_budget_cm: Positive | None = Field(
        default=None,
        description="limit of the root-mean-square distance of the event's joint at its event, cm",
    )
    cost: Literal["numbers", "operations"] = Field(
        default="numbers",
        description="cost to minimise within the budgets: numbers stored in the file, or "
        "multiply-adds per pose",
    )

    @property
    def details(self) -> Sequence[Detail]:
        """Return the coarser levels of detail."""
        return DEFAULT_LEVELS if self.levels is None else self.levels

    @field_validator("levels")
    @classmethod
    def _check_level_order(cls, levels: list[Detail] | None) -> list[Detail] | None:
        times = [level.times for level in levels or []]
        if times != sorted(set(times)):
            raise ValueError(f"times {times}, expected each larger than the one before")
        return levels

    @property
    def budgets(self) -> dict[str, float]:
        """Return the given budgets, m, by name: rms, p99, effector."""
        centimetres = {
            "rms": self.rms_budget_cm,
            "p99": self.p99_budget_cm,
            "effector": self.effector_budget_cm,
        }
        return {name: 0.01 * budget for name, budget in centimetres.items() if budget is not None}

    @model_validator(mode="after")
    def _check_size(self) -> "Size":
        keys = "rms_budget_cm, p99_budget_cm, effector_budget_cm"
        if self.ranks is None and not self.budgets:
            raise ValueError(f"found neither, expected either ranks or budgets ({keys})")
        if self.ranks is not None and (self.budgets or "cost" in self.model_fields_set):
            keys_set = sorted(self.model_fields_set)
            raise ValueError(
                f"found {keys_set}, expected either ranks or budgets ({keys}) and a cost"
            )
        return self


class Preset(RecipePart):
    """Named point of the controls: a value for each control, by the control's name."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)
    __pydantic_extra__: dict[str, FiniteNumber] = Field(init=False)

    performer: Text | None = Field(
        default=None, description="performer of the motion; default: an unseen performer"
    )
    named: dict[Name, Text] = Field(
        default={},
        alias="labels",
        description="name of the motion in further label sets; those not given are left open",
    )

    @property
    def labels(self) -> dict[str, str]:
        """Return the name of the motion in each label set that the preset names."""
        return ({} if self.performer is None else {PERFORMER: self.performer}) | self.named

    @property
    def values(self) -> dict[str, float]:
        """Return the values of the controls by name."""
        return dict(self.__pydantic_extra__)
