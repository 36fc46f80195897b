"""Recipe of a training: a validated TOML file.

The recipe refers to a CSV table with the data of each clip. Ambiguous recipes are refused: unknown
keys, missing units, duplicate names.
"""

import json
import re
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationError, field_validator, model_validator

from posefield.common.errors import RecipeError
from posefield.common.name_suggestion import did_you_mean
from posefield.common.units import UpAxis
from posefield.motion import measures
from posefield.motion.joint_roles import Role
from posefield_train.source import data_folder, recipe_errors
from posefield_train.source.control_sources import (
    RESERVED,
    TIME_NAMES,
    Auto,
    Control,
    ControlColumn,
    ControlMeasured,
    Curves,
    KeyFault,
    Name,
    RecipePart,
    Text,
)
from posefield_train.source.rigs.facing import Facing

PERFORMER = "performer"
"""Label set whose column is clips.performer."""
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
FiniteNumber = Annotated[float, Field(allow_inf_nan=False)]


class Source(RecipePart):
    """Unit and axes of the motion files; a BVH file states neither its unit nor its up axis."""

    metres_per_unit: Positive = Field(description="length of one unit of the files, m")
    up: UpAxis = Field(description="the files' up axis; their frame is right-handed")
    root_offset: Literal["replace", "add"] | None = Field(
        default=None,
        description="whether root position channels replace the root's OFFSET or add to it; "
        "default: replace, with a note if the OFFSET is not zero",
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

    table: Text = Field(description="CSV file, relative to the data folder")
    file: Text = Field(description="column: motion file, relative to the table")
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
        default=[], description="joints of the feet, for the measurement of foot skate"
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


class Alignment(RecipePart):
    """Time warping."""

    knots: Annotated[int, Field(ge=3, le=24)] = Field(
        default=6, description="number of free increments of a time warp; few knots avoid jerk"
    )
    rounds: Annotated[int, Field(ge=0, le=8)] = Field(
        default=2, description="number of re-alignments after the alignment to the medoid"
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
    def _read_one_label(cls, found: object) -> object:
        return [found] if isinstance(found, str) else found

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
        given = {
            "rms": self.rms_budget_cm,
            "p99": self.p99_budget_cm,
            "effector": self.effector_budget_cm,
        }
        return {name: 0.01 * budget for name, budget in given.items() if budget is not None}

    @model_validator(mode="after")
    def _check_size(self) -> "Size":
        keys = "rms_budget_cm, p99_budget_cm, effector_budget_cm"
        if self.ranks is None and not self.budgets:
            raise ValueError(f"found neither, expected either ranks or budgets ({keys})")
        if self.ranks is not None and (self.budgets or "cost" in self.model_fields_set):
            found = sorted(self.model_fields_set)
            raise ValueError(f"found {found}, expected either ranks or budgets ({keys}) and a cost")
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


# Quantities that only a whole cycle has.
CYCLE_QUANTITIES = (*measures.TRAVEL_QUANTITIES, "step_length")


class Recipe(RecipePart):
    """Complete recipe."""

    schema_version: Literal[1] = Field(alias="schema", description="version of this format")
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,63}$")]
    description: Text
    licence: Text = Field(description="licence of the motion data, with its required attribution")
    truth: Literal["reaching"] | None = Field(
        default=None,
        description="procedural family with known noise-free motions at all control values",
    )
    source: Source
    clips: Clips
    controls: Annotated[list[Control], Field(min_length=1)]
    motion: Motion
    alignment: Alignment = Alignment()
    kriging: Kriging = Kriging()
    event: Event | None = None
    curves: Curves | None = None
    roles: dict[Role, Text] = Field(
        default={},
        description="joints by role; exports need them for the joint names of Mixamo, Unreal, VRM "
        "or HumanIK",
    )
    presets: dict[Name, Preset] = Field(
        default={},
        description="named points of the controls within the sampled ranges, such as "
        "[presets.stroll]: offered as buttons by the page",
    )
    size: Size

    @property
    def column_controls(self) -> list[ControlColumn]:
        """Return the controls with values in the table."""
        return [control for control in self.controls if isinstance(control, ControlColumn)]

    @property
    def measured(self) -> list[ControlMeasured]:
        """Return the controls that are measured from the clips."""
        return [control for control in self.controls if isinstance(control, ControlMeasured)]

    @property
    def landmark_names(self) -> list[str]:
        """Return the columns of the landmarks, and the event's moment if it is found in clips."""
        found = [self.event.at] if self.event and self.event.is_found else []
        return [*self.clips.landmarks, *found]

    def leg_ends(self, auto: Auto) -> list[str]:
        """Return the two feet of a step, or the ends of a leg; empty for other quantities."""
        if auto.quantity == "step_length":
            return list(auto.joints or self.motion.feet)
        if auto.quantity == "leg_length":
            leg = [self.roles.get("leftUpperLeg"), self.roles.get("leftFoot")]
            return list(auto.joints or filter(None, leg))
        return []

    @model_validator(mode="after")
    def _check_label(self) -> "Recipe":
        if PERFORMER in self.clips.labels:
            raise KeyFault(
                "found 'performer', whose column is clips.performer", "clips", "labels", PERFORMER
            )
        for name in self.kriging.label:
            if name == PERFORMER and not self.clips.performer:
                raise KeyFault(
                    "found 'performer', but clips.performer names no column", "kriging", "label"
                )
            if name != PERFORMER and name not in self.clips.labels:
                known = (PERFORMER, *self.clips.labels)
                raise KeyFault(
                    f"found {name!r}{did_you_mean(name, known)}, expected 'performer' or a name of "
                    f"clips.labels {[*self.clips.labels]}",
                    *("kriging", "label"),
                )
        unused = [name for name in self.clips.labels if name not in self.kriging.label]
        if unused:
            raise KeyFault(
                f"found {unused[0]!r}, which kriging.label does not name, expected it there",
                *("clips", "labels", unused[0]),
            )
        return self

    @model_validator(mode="after")
    def _check_label_names(self) -> "Recipe":
        controls = [control.name for control in self.controls]
        for name in self.kriging.label:
            if name in controls:
                raise KeyFault(
                    f"found {name!r}, which is a control, too, expected another name",
                    *("kriging", "label"),
                )
            if name in RESERVED - {PERFORMER}:
                raise KeyFault(
                    f"found {name!r}, which is a parameter of requests, expected another name",
                    *("kriging", "label"),
                )
        return self

    @field_validator("controls")
    @classmethod
    def _check_control_names(cls, controls: list[Control]) -> list[Control]:
        names = [control.name for control in controls]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise ValueError(f"controls named twice: {sorted(twice)}")
        return controls

    @model_validator(mode="after")
    def _check_presets(self) -> "Recipe":
        names = [control.name for control in self.controls]
        for name, preset in self.presets.items():
            if sorted(preset.values) != sorted(names):
                found = ", ".join(preset.values) or "nothing"
                raise KeyFault(
                    f"found {found}, expected a value for each of {names}", "presets", name
                )
            for label_set, label in preset.labels.items():
                if label_set not in self.kriging.label:
                    raise KeyFault(
                        f"found {label!r} and no kriging.label {label_set!r}"
                        f"{did_you_mean(label_set, self.kriging.label)}, expected kriging.label = "
                        f"{label_set!r}",
                        *("presets", name),
                        *((PERFORMER,) if label_set == PERFORMER else ("labels", label_set)),
                    )
        return self

    @model_validator(mode="after")
    def _check_measured_controls(self) -> "Recipe":
        for index, control in enumerate(self.controls):
            if isinstance(control, ControlMeasured):
                for key, fault in self._measurement_faults(control.auto):
                    raise KeyFault(f"{fault} (control {control.name})", "controls", index, *key)
        return self

    def _measurement_faults(self, auto: Auto) -> Iterator[tuple[tuple[str, ...], str]]:
        """Yield the reasons for which a quantity cannot be measured, each with its key."""
        quantity, landmarks = auto.quantity, self.clips.landmarks
        if quantity in CYCLE_QUANTITIES and not self.motion.cyclic:
            yield (
                ("auto", "quantity"),
                f"found {quantity!r} and motion.cyclic = false, expected a cycle: of a motion that "
                "ends elsewhere it depends on the cut",
            )
        if quantity in ("speed", "stride_length") and self.motion.root == "in_place":
            found = f"found {quantity!r} and motion.root = 'in_place', expected one that travels"
            yield ("auto", "quantity"), found
        if auto.at is not None and (fault := _moment_fault(auto.at, landmarks)):
            yield ("auto", "at"), fault
        if quantity == "step_length" and len(self.leg_ends(auto)) != 2:
            found = f"found none and motion.feet {self.motion.feet}, expected two feet"
            yield ("auto", "joints"), found
        if quantity == "leg_length" and len(self.leg_ends(auto)) != 2:
            yield (
                ("auto", "joints"),
                "found none, and not both roles leftUpperLeg and leftFoot; expected the upper end "
                "of a leg and its lower",
            )

    @field_validator("roles")
    @classmethod
    def _check_roles(cls, roles: dict[Role, str]) -> dict[Role, str]:
        joints = list(roles.values())
        twice = sorted({joint for joint in joints if joints.count(joint) > 1})
        if twice:
            raise ValueError(f"joints with two roles: {twice}, expected one each")
        return roles

    @model_validator(mode="after")
    def _check_event(self) -> "Recipe":
        if self.event is None:
            if self.size.effector_budget_cm is not None:
                raise KeyFault(
                    f"found {self.size.effector_budget_cm:g} and no [event], expected event.joint "
                    "and event.at to say where it counts",
                    *("size", "effector_budget_cm"),
                )
        elif fault := _moment_fault(self.event.at, self.clips.landmarks):
            raise KeyFault(fault, "event", "at")
        return self

    @model_validator(mode="after")
    def _check_landmarks(self) -> "Recipe":
        for index, name in enumerate(self.clips.landmarks):
            if name in TIME_NAMES:
                raise KeyFault(
                    f"found {name!r}, a moment that is found in the motion, expected a column of "
                    "another name",
                    *("clips", "landmarks", index),
                )
        return self


def _moment_fault(at: str, landmarks: list[str]) -> str | None:
    """Return the fault of an unknown moment; None for a known one."""
    known = (*TIME_NAMES, *landmarks)
    if at in known:
        return None
    moments = ", ".join(map(repr, TIME_NAMES))
    expected = f"expected {moments} or a column of clips.landmarks {landmarks}"
    return f"found {at!r}{did_you_mean(at, known)}, {expected}"


MAX_BYTES = 128_000
"""Size of a recipe; those of the project take 3 kB."""

MAX_DOTS = 1_000
"""Dots in one key: far more than MOST_LEVELS, and few enough to parse quickly."""

MAX_DEPTH = 16
"""Nesting depth of tables and arrays; a recipe needs five."""


def read(path: Path) -> Recipe:
    """Return the recipe of a TOML file; RecipeError names the invalid key."""
    content = data_folder.read(path, MAX_BYTES, "a recipe")
    try:
        text = content.decode()
    except UnicodeDecodeError as fault:
        raise RecipeError(path, f"not UTF-8 text: {fault}") from fault
    # tomllib takes quadratic time in the parts of a key: 40 s for a key of MOST_BYTES.
    if any(line.partition("=")[0].count(".") > MAX_DOTS for line in text.splitlines()):
        raise RecipeError(path, TOO_DEEP)
    try:
        found = tomllib.loads(text)
    except RecursionError as fault:
        raise RecipeError(path, TOO_DEEP) from fault
    except ValueError as fault:
        # ValueError covers TOMLDecodeError and int's error for a number of thousands of digits.
        raise _syntax_error(path, str(fault)) from fault
    if _nesting_depth(found) > MAX_DEPTH:
        raise RecipeError(path, TOO_DEEP)
    try:
        return Recipe.model_validate(found)
    except ValidationError as fault:
        raise recipe_errors.recipe_error(path, text, Recipe, fault) from fault


TOO_DEEP = f"tables or arrays nested deeper than {MAX_DEPTH} levels, expected at most that many"


def _nesting_depth(found: dict[str, Any]) -> int:
    """Return the nesting depth of tables and arrays, at most MOST_LEVELS + 1."""
    inside: list[Any] = [found]
    for level in range(MAX_DEPTH + 1):
        if not inside:
            return level
        parts = (one.values() if isinstance(one, dict) else one for one in inside)
        inside = [one for part in parts for one in part if isinstance(one, dict | list)]
    return MAX_DEPTH + 1


PLACE = re.compile(r" \(at line (\d+), column (\d+)\)$")
"""End of a message of tomllib."""


def _syntax_error(path: Path, message: str) -> RecipeError:
    """Return the error of a message of tomllib; an error at the end of the text has no place."""
    place = PLACE.search(message)
    where = map(int, place.groups()) if place else ()
    return RecipeError(path, f"not TOML: {PLACE.sub('', message)}", *where)


def json_schema() -> str:
    """Return the JSON Schema of the recipe, which editors use."""
    schema: dict[str, Any] = Recipe.model_json_schema(by_alias=True)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps(schema, indent=2, sort_keys=True) + "\n"
