"""Tables of formats: encoders of clips, performances, poses, crowds and grids by extension.

The table of archives is `archives.ARCHIVE_WRITERS`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

from msgspec import structs

from posefield.common import cancellation
from posefield.common.errors import InvalidField, UnknownFormat, did_you_mean
from posefield.common.units import LengthUnit, UpAxis
from posefield.encode import character, glb, model_tables, motion_tables, vrma
from posefield.encode import table as tables
from posefield.encode.archives import ARROW, JSON, MSGPACK, NPZ, Format, by_extension
from posefield.encode.character import CENTIMETRES, METRES, METRES_PER_UNIT, Convention
from posefield.encode.crowd_size import STREAMS
from posefield.encode.table import Table, arrow_stream, npz_table
from posefield.motion import bvh_writer, joint_roles, root_bone
from posefield.motion.clip import CrowdPoses
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import BodyKind
from posefield.question.performance_question import PerformanceLayout
from posefield.question.performance_report import PerformanceAnswer
from posefield.question.results import ClipAnswer, PoseAnswer, SampledClip, SigmaGrid
from posefield.robots import robot_clip, robot_formats
from posefield.robots.robot import Robot
from posefield.robots.robot_formats import RobotFormat


def bvh(answer: SampledClip, convention: Convention) -> bytes:
    """Return a BVH file; the format cannot store provenance, unit or up axis."""
    converted = answer.clip
    if converted.root_bone:
        converted = root_bone.add_root(converted, root_bone.with_root(converted.skeleton))
    clip = character.convert_clip(Convention(1.0, convention.up), converted)
    return bvh_writer.dumps(clip, metres_per_unit=convention.metres_per_unit)


A = TypeVar("A", contravariant=True)
WORKING = 165
"""Largest number of bytes of memory of a joint in a frame while a file is made."""


@dataclass(frozen=True)
class ClipEncoder(Format):
    """Encoder of clips in one format; equal results give equal bytes.

    write: returns the files of several results, in their order; those of one model and length are
    computed together. bytes_per_joint: largest number of bytes of a joint in a frame, without the
    parts that all frames share. working: the same of memory, measured for long performances.
    default_convention: the convention, which its readers expect. convention_fixed: whether the
    format allows no other convention. inline_limit: number of frames up to which a file is written
    in a millisecond or two, so that other requests may wait for it. has_body, has_curves: whether
    the format carries a body and curves. of_robots: whether it holds reference motions of robots.
    is_humanoid: whether it has the bones of a person alone.
    """

    write: Callable[[Sequence[SampledClip], Convention], list[bytes]]
    bytes_per_joint: int
    working: int = WORKING
    default_convention: Convention = METRES
    convention_fixed: bool = False
    inline_limit: int = 200
    has_body: bool = False
    has_curves: bool = True
    of_robots: bool = False
    is_humanoid: bool = False

    def check(self, robot: Robot | None) -> None:
        """Raise InvalidField for a reference motion of a model of no robot."""
        if self.of_robots:
            robot_clip.require(robot, self.extension)

    def check_body(self, joints: Skeleton, roles: Mapping[str, str]) -> None:
        """Raise InvalidField for a skeleton that files of the format cannot move.

        roles: joint name by role.
        """
        if self.is_humanoid:
            vrma.humanoid(joints, joint_roles.role_joints(joints, roles))

    def convention(
        self, unit: LengthUnit | None, up: UpAxis | None, body: BodyKind | None = None
    ) -> Convention:
        """Return the requested convention; None is the format's default.

        Raises InvalidField for a convention that the format does not allow, and for a body in a
        format that carries none.
        """
        if body is not None and not self.has_body:
            raise InvalidField(
                "body",
                f"{body!r}, expected none given: {self.extension} files carry no body, "
                "usda, usdc, usdz and glb do",
            )
        length = self.default_convention.metres_per_unit if unit is None else METRES_PER_UNIT[unit]
        convention = Convention(
            length, up or self.default_convention.up, body or self.default_convention.body
        )
        law = f"the law of {self.extension}"
        if self.convention_fixed and length != self.default_convention.metres_per_unit:
            expected = f"expected {self.default_convention.metres_per_unit:g} m"
            raise InvalidField("unit", f"{length:g} m, {expected}: {law}")
        if self.convention_fixed and convention.up != self.default_convention.up:
            raise InvalidField(
                "up", f"{convention.up!r}, expected {self.default_convention.up!r}: {law}"
            )
        return convention

    def noted(self, answer: ClipAnswer) -> ClipAnswer:
        """Return a result with warnings of its curves and root bone if the format has none."""
        notes = []
        if answer.clip.curves is not None and not self.has_curves:
            notes.append(left_out(answer.clip.curves.names, self.extension))
        if answer.clip.root_bone and not (self.has_body or self.extension == "bvh"):
            hips = "the base travels" if self.of_robots else "the hips travel"
            notes.append(f"{self.extension} files have no root bone: {hips}")
        warnings = (*answer.trust.warnings, *notes)
        if not notes:
            return answer
        return replace(answer, trust=structs.replace(answer.trust, warnings=warnings))

    def encode(self, answer: SampledClip, convention: Convention | None = None) -> bytes:
        """Return the file of one result, in the format's default convention unless one is given."""
        return self.write([answer], convention or self.default_convention)[0]


CURVES_PER_JOINT = 4
"""Curves that take as many bytes as a joint, of four numbers or more."""


def left_out(curves: Sequence[str], extension: str) -> str:
    """Return the sentence on curves that files of a format do not have."""
    with_curves = [name for name, encoder in CLIP_ENCODERS.items() if encoder.has_curves]
    return (
        f"{extension} files carry no curves: {len(curves)} are left out ({', '.join(curves)}); "
        f"{', '.join(with_curves)} have them"
    )


ANSWER_MEMORY = 480_000_000
"""Bytes for making one answer; a process with shipped models takes 200 MB beside it."""


def max_poses(
    size: int, joints: int, encoder: "ClipEncoder | TableEncoder[Any]", curves: int = 0
) -> int:
    """Return how many poses fit in a file of `size` bytes and in the memory for making it.

    The root position counts as a joint.
    """
    joint_count = joints + 1 + math.ceil(curves / CURVES_PER_JOINT)
    return min(size // encoder.bytes_per_joint, ANSWER_MEMORY // encoder.working) // joint_count


def sequential_writer(
    encode: Callable[[SampledClip, Convention], bytes],
) -> Callable[[Sequence[SampledClip], Convention], list[bytes]]:
    """Return a function that encodes several results one after the other."""

    def write(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
        files = []
        for answer in answers:
            cancellation.check()
            files.append(encode(answer, convention))
        return files

    return write


def table_writer(
    write: Callable[[Table], bytes],
) -> Callable[[Sequence[SampledClip], Convention], list[bytes]]:
    """Return a function that encodes several results as tables."""
    return sequential_writer(
        lambda answer, convention: write(motion_tables.clip_table(answer, convention))
    )


def _lazy_usd_writer(name: str) -> Callable[[Sequence[SampledClip], Convention], list[bytes]]:
    """Return the USD writer of that name, which imports usd-core when it is first called.

    The import takes 0.12 CPU seconds, a seventh of the service's start.
    """

    def write(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
        from posefield.encode import usd_clip

        writers = {"usda": usd_clip.usda, "usdc": usd_clip.usdc, "usdz": usd_clip.usdz}
        return writers[name](answers, convention)

    return write


CLIP_ENCODERS = by_extension(
    # usd-core takes milliseconds, and tens of them for the first template of a binary layer.
    ClipEncoder(
        "usda", "model/vnd.usda", _lazy_usd_writer("usda"), 120, 290, inline_limit=0, has_body=True
    ),
    # Unlike those of usda and usdz, not registered with IANA, but in common use.
    ClipEncoder(
        "usdc", "model/vnd.usdc", _lazy_usd_writer("usdc"), 48, inline_limit=0, has_body=True
    ),
    ClipEncoder(
        "usdz", "model/vnd.usdz+zip", _lazy_usd_writer("usdz"), 48, inline_limit=0, has_body=True
    ),
    ClipEncoder("json", JSON, sequential_writer(motion_tables.clip_json), 96, 180),
    ClipEncoder(
        "bvh", "application/x-bvh", sequential_writer(bvh), 72, 360, CENTIMETRES, has_curves=False
    ),
    ClipEncoder(
        "glb",
        "model/gltf-binary",
        sequential_writer(glb.glb),
        24,
        convention_fixed=True,
        has_body=True,
    ),
    # Not registered with IANA: its readers go by the ending of the name.
    ClipEncoder(
        "vrma",
        "model/vnd.vrma",
        sequential_writer(vrma.vrma),
        24,
        convention_fixed=True,
        is_humanoid=True,
    ),
    ClipEncoder("npz", NPZ, table_writer(npz_table), 24),
    ClipEncoder("arrow", ARROW, table_writer(arrow_stream), 24),
    ClipEncoder("msgpack", MSGPACK, table_writer(tables.msgpack_table), 24),
)


def _robot_encoder(form: RobotFormat) -> ClipEncoder:
    """Return the encoder of a format of reference motions, which has metres and Z up."""

    def encode(answer: SampledClip, _: Convention) -> bytes:
        # A performance, or a clip of a user's character, is of no robot.
        single = answer if isinstance(answer, ClipAnswer) else None
        robot = robot_clip.require(single.robot if single else None, form.name)
        assert single
        if len(single.clip) < 2:
            raise InvalidField("end", "1 frame, expected two or more: files have velocities")
        source = single.trust.model.partition("@")[0]
        assert form.write is not None
        return form.write(robot_clip.of(robot).motion(single.clip, source, single.loops), robot)

    return ClipEncoder(
        form.name,
        ROBOT_MEDIA_TYPES[form.suffix],
        sequential_writer(encode),
        # A body has 13 numbers and a hinge 2 in files of arrays.
        bytes_per_joint=130,
        working=700,
        default_convention=Convention(1.0, "z"),
        convention_fixed=True,
        inline_limit=0,
        has_curves=False,
        of_robots=True,
    )


ROBOT_MEDIA_TYPES = {
    ".csv": "text/csv",
    ".npz": NPZ,
    # No type is registered for pickles.
    ".pkl": "application/octet-stream",
    # Of other fields than the JSON documents of the contract.
    ".json": "text/plain",
    ".txt": "text/plain",
}
ROBOT_ENCODERS = by_extension(*map(_robot_encoder, robot_formats.WRITTEN.values()))
"""Encoders of reference motions, of models of robots alone."""
ALL_ENCODERS = {**CLIP_ENCODERS, **ROBOT_ENCODERS}


def encoder_for(path: Path) -> ClipEncoder:
    """Return the encoder for the end of a path's name; UnknownFormat if there is none."""
    if reference := robot_formats.of_file(path.name):
        return ROBOT_ENCODERS[reference.name]
    extension = path.suffix.removeprefix(".")
    if extension not in CLIP_ENCODERS:
        extensions, hint = ", ".join(CLIP_ENCODERS), did_you_mean(extension, CLIP_ENCODERS)
        raise UnknownFormat("output", f"{path.name!r} ends in none of {extensions}{hint}")
    return CLIP_ENCODERS[extension]


@dataclass(frozen=True)
class TableEncoder(Format, Generic[A]):
    """Encoder of poses, crowd poses or grids as tables in one format.

    table: returns the table of a result. write: returns its bytes. inline_limit: number of poses or
    grid points up to which a result is computed and written in about a millisecond, so that other
    requests may wait for it. bytes_per_joint: largest number of bytes of a joint of a character.
    working: the same of memory. max_characters: largest number of characters.
    """

    table: Callable[[A], Table]
    write: Callable[[Table], bytes]
    inline_limit: int = 0
    bytes_per_joint: int = 40
    working: int = WORKING
    max_characters: float = math.inf

    def encode(self, answer: A) -> bytes:
        """Return the bytes of a result."""
        return self.write(self.table(answer))


POSE_ENCODERS: dict[str, TableEncoder[PoseAnswer[Any]]] = by_extension(
    TableEncoder("json", JSON, motion_tables.pose_table, tables.json_table, inline_limit=200),
    TableEncoder(
        "msgpack", MSGPACK, motion_tables.pose_table, tables.msgpack_table, inline_limit=2000
    ),
    TableEncoder("npz", NPZ, motion_tables.pose_table, npz_table, inline_limit=2000),
    TableEncoder("arrow", ARROW, motion_tables.pose_table, arrow_stream, inline_limit=2000),
)

CROWD_ENCODERS: dict[str, TableEncoder[CrowdPoses]] = by_extension(
    TableEncoder("arrow", ARROW, motion_tables.crowd_table, arrow_stream, inline_limit=1000),
    TableEncoder("npz", NPZ, motion_tables.crowd_table, npz_table, inline_limit=1000),
    TableEncoder(
        "msgpack", MSGPACK, motion_tables.crowd_table, tables.msgpack_table, inline_limit=1000
    ),
    TableEncoder(
        "json",
        JSON,
        motion_tables.crowd_table,
        tables.json_table,
        bytes_per_joint=150,
        max_characters=motion_tables.MAX_JSON_CHARACTERS,
    ),
)

GRID_ENCODERS: dict[str, TableEncoder[SigmaGrid]] = by_extension(
    TableEncoder("json", JSON, model_tables.table, tables.json_table, inline_limit=1024),
    TableEncoder("msgpack", MSGPACK, model_tables.table, tables.msgpack_table, inline_limit=1024),
    TableEncoder("npz", NPZ, model_tables.table, npz_table, inline_limit=1024),
    # A stream of rows, one for each point of the grid.
    TableEncoder("arrow", ARROW, model_tables.points, arrow_stream, inline_limit=1024),
)


CROWD_FORMATS = by_extension(*(Format(name, CLIP_ENCODERS[name].media_type) for name in STREAMS))
"""Formats in which `crowd_writer.stream` writes walking crowds."""


SEGMENTED = ("usda", "usdc", "usdz")
"""Formats that have layouts."""

PerformanceEncoder = Callable[[PerformanceAnswer, Convention], bytes]


def performance_encoder(form: ClipEncoder, layout: PerformanceLayout) -> PerformanceEncoder:
    """Return the function that encodes performances in a format and a layout.

    Raises InvalidField for a layout of segments in a format that has none.
    """
    if form.of_robots:
        form.check(None)
    if layout == "whole":
        return form.encode
    if form.extension not in SEGMENTED:
        raise InvalidField(
            "layout",
            f"{layout!r}, expected 'whole': {form.extension} files have no layouts, "
            f"{', '.join(SEGMENTED[:-1])} and {SEGMENTED[-1]} do",
        )

    def encode(answer: PerformanceAnswer, convention: Convention) -> bytes:
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.encode import performance_layer

        writers = {
            "usda": performance_layer.usda,
            "usdc": performance_layer.usdc,
            "usdz": performance_layer.usdz,
        }
        return writers[form.extension](answer, convention)

    return encode
