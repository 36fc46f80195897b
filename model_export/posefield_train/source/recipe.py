"""Recipe of a training: a validated TOML file, and its errors with line and key.

The recipe refers to a CSV table with the data of each clip. Ambiguous recipes are refused: unknown
keys, missing units, duplicate names. Its sections are in `recipe_sections`.
"""

import json
import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    BaseModel,
    Field,
    PrivateAttr,
    ValidationError,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails

from posefield.common.errors import RecipeError, did_you_mean
from posefield.motion import measures
from posefield.motion.joint_roles import Role
from posefield_train.source import data_folder
from posefield_train.source.control_sources import (
    COLUMN_TAG,
    MEASURED,
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
from posefield_train.source.recipe_sections import (
    PERFORMER,
    Alignment,
    Clips,
    Contacts,
    Event,
    Kriging,
    Motion,
    Preset,
    RobotSource,
    Size,
    SkeletonSettings,
    Source,
)

Key = tuple[str | int, ...]
"""Path of a value: names of tables and keys, and indices of arrays."""
NAME = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
# Strings of several lines, which may hold lines like keys; headers of tables; and keys.
STATEMENT = re.compile(
    r'"""(?:\\.|[^\\])*?"""|\'\'\'.*?\'\'\'|'
    rf"^[ \t]*(?P<brackets>\[{{0,2}})[ \t]*(?P<names>{NAME}(?:[ \t]*\.[ \t]*{NAME})*)[ \t]*[]=]",
    re.MULTILINE | re.DOTALL,
)
SHOWN = 200
"""Characters of a value in a message."""
MAX_LISTED = 20
"""Mistakes that are listed; a recipe with more was not meant as one."""


def recipe_error(
    path: Path, text: str, form: type[BaseModel], fault: ValidationError
) -> RecipeError:
    """Return the error of all mistakes in the text of a recipe, one on each line.

    form: type of the recipe. A missing key has the line of its table, or the first.
    """
    lines = {(): 1} | key_lines(text)
    listed = [
        _mistake(form, error)
        for error in fault.errors(include_url=False)
        # It only follows from another error.
        if error["type"] != "default_factory_not_called"
    ]
    errors = [
        RecipeError(
            path,
            message,
            next(lines[key[:end]] for end in range(len(key), -1, -1) if key[:end] in lines),
        )
        for key, message in listed[:MAX_LISTED]
    ]
    first, *further = errors
    if len(listed) > MAX_LISTED:
        further.append(RecipeError(path, f"{len(listed) - MAX_LISTED} further mistakes"))
    return RecipeError(path, "\n".join([first.message, *map(str, further)]), first.line)


def key_lines(text: str) -> dict[Key, int]:
    """Return the line, from 1, of each table and key of a valid TOML text that begins a line."""
    lines: dict[Key, int] = {}
    lengths: dict[Key, int] = {}
    table: Key = ()
    for match in STATEMENT.finditer(text):
        if match["names"] is None:
            continue
        names = [name.strip("\"'") for name in re.findall(NAME, match["names"])]
        path: Key = () if match["brackets"] else table
        for number, name in enumerate(names, 1):
            path += (name,)
            if match["brackets"] == "[[" and number == len(names):
                lengths[path] = lengths.get(path, 0) + 1
            if path in lengths:
                path += (lengths[path] - 1,)
            lines.setdefault(path, text.count("\n", 0, match.start("names")) + 1)
        table = path if match["brackets"] else table
    return lines


def _mistake(form: type[BaseModel], error: ErrorDetails) -> tuple[Key, str]:
    key: Key = tuple(
        component for component in error["loc"] if component not in (COLUMN_TAG, MEASURED)
    )
    message, quoted = error["msg"], ""
    match error["type"]:
        case "value_error":
            fault = error["ctx"]["error"]
            key, message = key + getattr(fault, "keys", ()), str(fault)
        case "missing":
            pass
        case "extra_forbidden":
            keys = _known_keys(form, error["loc"][:-1])
            hint = did_you_mean(str(key[-1]), keys)
            quoted = f"{hint}{_quote_input(error['input'])}; expected some of {', '.join(keys)}"
        case _:
            quoted = _quote_input(error["input"])
    return key, f"{'.'.join(map(str, key)) or 'recipe'}: {message}{quoted}"


def _quote_input(value: Any) -> str:
    text = repr(value)
    return f", found {text if len(text) <= SHOWN else f'{text[:SHOWN]}...'}"


def _known_keys(form: type[BaseModel], loc: Sequence[str | int]) -> list[str]:
    kinds = [form]
    for component in loc:
        if component in (COLUMN_TAG, MEASURED):
            field_name = "column" if component == COLUMN_TAG else "auto"
            kinds = [kind for kind in kinds if field_name in kind.model_fields]
        elif isinstance(component, str):
            # A name that is no field is a key of a table with free keys.
            fields = [
                kind.model_fields[component] for kind in kinds if component in kind.model_fields
            ]
            kinds = [model for one in fields for model in _models(one.annotation)] or kinds
    return [field.alias or name for kind in kinds for name, field in kind.model_fields.items()]


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for argument in get_args(annotation) for model in _models(argument)]


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
    accepted: bool = Field(
        default=True,
        description="whether a person agrees with the recipe; posefield discover writes false, and "
        "no model is trained until posefield review --accept, or an editor, writes true",
    )
    source: Source
    robot: RobotSource | None = None
    clips: Clips
    skeleton: SkeletonSettings = SkeletonSettings()
    controls: Annotated[list[Control], Field(min_length=1)]
    motion: Motion
    alignment: Alignment = Alignment()
    kriging: Kriging = Kriging()
    event: Event | None = None
    curves: Curves | None = None
    contacts: Contacts = Contacts()
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
    _folder: Path | None = PrivateAttr(default=None)
    _notes: tuple[str, ...] = PrivateAttr(default=())

    @property
    def notes(self) -> tuple[str, ...]:
        """Return notes on keys of the recipe's file that have other names now."""
        return self._notes

    @property
    def folder(self) -> Path | None:
        """Return the folder of the recipe's file; None for a recipe that was not read of one."""
        return self._folder

    def model_post_init(self, context: Any, /) -> None:
        """Keep folder and notes that the reader of the file tells in the context of validation."""
        self._folder = (context or {}).get("folder")
        self._notes = (context or {}).get("notes", ())

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
        event_names = [self.event.at] if self.event and self.event.is_found else []
        return [*self.clips.landmarks, *event_names]

    def joint_with(self, role: Role) -> str | None:
        """Return the joint with a role; None if the recipe does not tell it."""
        return role if self.skeleton.is_unified else self.roles.get(role)

    def leg_ends(self, auto: Auto) -> list[str]:
        """Return the two feet of a step, or the ends of a leg; empty for other quantities."""
        if auto.quantity == "step_length":
            return list(auto.joints or self.motion.feet)
        if auto.quantity == "leg_length":
            leg = [self.joint_with("leftUpperLeg"), self.joint_with("leftFoot")]
            return list(auto.joints or filter(None, leg))
        return []

    @model_validator(mode="before")
    @classmethod
    def _complete_source(cls, tables: Any) -> Any:
        """Add what files of robots need not state: their unit, and the axes that reading gives."""
        if isinstance(tables, dict) and "robot" in tables:
            source = {"metres_per_unit": 1.0, "up": "y", **tables.get("source", {})}
            return {**tables, "source": source}
        return tables

    @field_validator("controls")
    @classmethod
    def _check_control_names(cls, controls: list[Control]) -> list[Control]:
        names = [control.name for control in controls]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise ValueError(f"controls named twice: {sorted(twice)}")
        return controls

    @field_validator("roles")
    @classmethod
    def _check_roles(cls, roles: dict[Role, str]) -> dict[Role, str]:
        joints = list(roles.values())
        twice = sorted({joint for joint in joints if joints.count(joint) > 1})
        if twice:
            raise ValueError(f"joints with two roles: {twice}, expected one each")
        return roles

    @model_validator(mode="after")
    def _check_sections(self) -> "Recipe":
        names = [control.name for control in self.controls]
        check_skeleton(self.skeleton, self.roles)
        check_labels(self.clips, self.kriging, names)
        check_presets(self.presets, names, self.kriging)
        for index, control in enumerate(self.controls):
            if isinstance(control, ControlMeasured):
                check_measurement(self, index, control)
        if self.alignment.warp == "identity" and self.landmark_names:
            raise KeyFault(
                f"found 'identity' and landmarks {self.landmark_names}, which warps move to one "
                "time, expected 'fitted'",
                *("alignment", "warp"),
            )
        check_moments(self.event, self.size, self.clips.landmarks)
        return self


MAX_BYTES = 128_000
"""Size of a recipe; those of the project take 3 kB."""

MAX_DOTS = 100
"""Dots in one key, few enough to parse quickly."""
TOO_DEEP = "tables or arrays nested too deep, expected at most five levels"


def read(path: Path) -> Recipe:
    """Return the recipe of a TOML file; RecipeError names the invalid key."""
    if path.suffix not in ("", ".toml"):
        fault = f"found a {path.suffix} file, expected a recipe, .toml: posefield init drafts one"
        raise RecipeError(path, fault)
    content = data_folder.read(path, MAX_BYTES, "a recipe")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise RecipeError(path, f"not UTF-8 text: {fault}") from fault
    # tomllib takes quadratic time in the parts of a key: 40 s for a key of MAX_BYTES.
    if any(line.partition("=")[0].count(".") > MAX_DOTS for line in text.splitlines()):
        raise RecipeError(path, TOO_DEEP)
    try:
        tables = tomllib.loads(text)
        notes = _rename_former_keys(path, text, tables)
        context = {"folder": path.parent, "notes": notes}
        return Recipe.model_validate(tables, context=context)
    except ValidationError as fault:
        raise recipe_error(path, text, Recipe, fault) from fault
    except RecursionError as fault:
        raise RecipeError(path, TOO_DEEP) from fault
    except ValueError as fault:
        # ValueError covers TOMLDecodeError and int's error for a number of thousands of digits.
        line = re.search(r"at line (\d+)", str(fault))
        raise RecipeError(path, f"not TOML: {fault}", int(line[1]) if line else None) from fault


def _rename_former_keys(path: Path, text: str, tables: dict[str, Any]) -> tuple[str, ...]:
    """Give keys of earlier versions their names, and return notes on them."""
    clips = tables.get("clips")
    if not isinstance(clips, dict) or "take" not in clips:
        return ()
    if "recording" in clips:
        fault = "clips.take: found it beside clips.recording, its name now, expected that alone"
        raise RecipeError(path, fault, key_lines(text).get(("clips", "take")))
    clips["recording"] = clips.pop("take")
    return (
        f"{path.name}: clips.take is called clips.recording now, expected from the next version on",
    )


def read_accepted(path: Path) -> Recipe:
    """Return the recipe of a TOML file; RecipeError also for one that no person accepted."""
    recipe = read(path)
    if not recipe.accepted:
        raise RecipeError(
            path,
            "accepted = false: look at its clips, then accept it with posefield review "
            f"{path.parent} --accept NUMBER, or write accepted = true",
        )
    return recipe


def json_schema() -> str:
    """Return the JSON Schema of the recipe, which editors use."""
    schema: dict[str, Any] = Recipe.model_json_schema(by_alias=True)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return json.dumps(schema, indent=2, sort_keys=True) + "\n"


# Quantities that only a whole cycle has.
CYCLE_QUANTITIES = (*measures.TRAVEL_QUANTITIES, "step_length")


def check_skeleton(skeleton: SkeletonSettings, roles: Collection[str]) -> None:
    """Raise KeyFault for roles that the topology does not use."""
    if skeleton.is_unified and roles:
        raise KeyFault(
            "found roles and skeleton.topology = 'roles', whose joints are named by their roles, "
            "expected those of the files as [skeleton.roles], if any",
            "roles",
        )
    if not skeleton.is_unified and skeleton.roles:
        raise KeyFault(
            "found roles and skeleton.topology = 'files', expected topology = 'roles', or the "
            "joints as [roles]",
            *("skeleton", "roles"),
        )


def check_labels(clips: Clips, kriging: Kriging, controls: Sequence[str]) -> None:
    """Raise KeyFault for label sets without a column or a name of their own, and unused columns."""
    if PERFORMER in clips.labels:
        raise KeyFault(
            "found 'performer', whose column is clips.performer", "clips", "labels", PERFORMER
        )
    for name in kriging.label:
        if name == PERFORMER and not clips.performer:
            raise KeyFault(
                "found 'performer', but clips.performer names no column", "kriging", "label"
            )
        if name != PERFORMER and name not in clips.labels:
            label_sets = (PERFORMER, *clips.labels)
            raise KeyFault(
                f"found {name!r}{did_you_mean(name, label_sets)}, expected 'performer' or a name "
                f"of clips.labels {[*clips.labels]}",
                *("kriging", "label"),
            )
    unused = [name for name in clips.labels if name not in kriging.label]
    if unused:
        raise KeyFault(
            f"found {unused[0]!r}, which kriging.label does not name, expected it there",
            *("clips", "labels", unused[0]),
        )
    for name in kriging.label:
        if name in controls or name in RESERVED - {PERFORMER}:
            meaning = "a control, too" if name in controls else "a parameter of requests"
            fault = f"found {name!r}, which is {meaning}, expected another name"
            raise KeyFault(fault, "kriging", "label")


def check_presets(presets: Mapping[str, Preset], controls: Sequence[str], kriging: Kriging) -> None:
    """Raise KeyFault for a preset with other controls, and for one with an unknown label set."""
    for name, preset in presets.items():
        if sorted(preset.values) != sorted(controls):
            listed = ", ".join(preset.values) or "nothing"
            fault = f"found {listed}, expected a value for each of {controls}"
            raise KeyFault(fault, "presets", name)
        for label_set, label in preset.labels.items():
            if label_set not in kriging.label:
                raise KeyFault(
                    f"found {label!r} and no kriging.label {label_set!r}"
                    f"{did_you_mean(label_set, kriging.label)}, expected kriging.label = "
                    f"{label_set!r}",
                    *("presets", name),
                    *((PERFORMER,) if label_set == PERFORMER else ("labels", label_set)),
                )


def check_measurement(recipe: "Recipe", index: int, control: ControlMeasured) -> None:
    """Raise KeyFault for a control whose quantity cannot be measured. index: of the control."""
    auto, motion, landmarks = control.auto, recipe.motion, recipe.clips.landmarks
    quantity = auto.quantity

    def refuse(fault: str, key: str) -> None:
        raise KeyFault(f"{fault} (control {control.name})", "controls", index, "auto", key)

    if quantity in CYCLE_QUANTITIES and not motion.cyclic:
        refuse(
            f"found {quantity!r} and motion.cyclic = false, expected a cycle: of a motion that "
            "ends elsewhere it depends on the cut",
            "quantity",
        )
    if quantity in ("speed", "stride_length") and motion.root == "in_place":
        refuse(
            f"found {quantity!r} and motion.root = 'in_place', expected one that travels",
            "quantity",
        )
    if auto.at is not None and (fault := _moment_fault(auto.at, landmarks)):
        refuse(fault, "at")
    if quantity == "step_length" and len(recipe.leg_ends(auto)) != 2:
        refuse(f"found none and motion.feet {motion.feet}, expected two feet", "joints")
    if quantity == "leg_length" and len(recipe.leg_ends(auto)) != 2:
        refuse(
            "found none, and not both roles leftUpperLeg and leftFoot; expected the upper end "
            "of a leg and its lower",
            "joints",
        )


def check_moments(event: Event | None, size: Size, landmarks: list[str]) -> None:
    """Raise KeyFault for an unknown moment, a budget without event, and a landmark named as one."""
    if event is None:
        if size.effector_budget_cm is not None:
            raise KeyFault(
                f"found {size.effector_budget_cm:g} and no [event], expected event.joint "
                "and event.at to say where it counts",
                *("size", "effector_budget_cm"),
            )
    elif fault := _moment_fault(event.at, landmarks):
        raise KeyFault(fault, "event", "at")
    for index, name in enumerate(landmarks):
        if name in TIME_NAMES:
            raise KeyFault(
                f"found {name!r}, a moment that is found in the motion, expected a column of "
                "another name",
                *("clips", "landmarks", index),
            )


def _moment_fault(at: str, landmarks: list[str]) -> str | None:
    moments = (*TIME_NAMES, *landmarks)
    if at in moments:
        return None
    expected = f"expected {', '.join(map(repr, TIME_NAMES))} or a column of clips.landmarks"
    return f"found {at!r}{did_you_mean(at, moments)}, {expected} {landmarks}"
