"""Models in this process: `import posefield` answers as the service does, without a server.

    model = posefield.load("hdm05_grab_high")
    clip = model.clip(target_height=1.7, target_forward=0.6)
    clip.save("reach.usdc")

Keywords are the fields of the questions (`posefield.question`), decoded and validated as the body
of a request; other keywords are controls, in the model's units. Lengths are metres, times seconds,
angles radians, quaternions w x y z; Y is up. Invalid input raises a MotionError.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from posefield.common import atomic_files
from posefield.common.errors import FileError, ModelError
from posefield.common.units import LengthUnit, UpAxis
from posefield.encode import crowd_formats, formats
from posefield.encode.formats import encoder_for
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.motion_question import BodyKind, ClipQuestion, PoseQuestion
from posefield.question.performance_question import PerformanceLayout, PerformanceQuestion
from posefield.question.performance_report import PerformanceAnswer
from posefield.question.results import ClipAnswer, PoseAnswer
from posefield.question.walk_question import WalkQuestion
from posefield.registry import model_registry
from posefield.registry.model_registry import ModelRegistry
from posefield.robots import robot_clip
from posefield.robots.robot_motion import RobotMotion
from posefield.synthesis import clips, poses
from posefield.synthesis.poses import MAX_POSES
from posefield.synthesis.synthesizer import Synthesizer
from posefield.tracks import track_crowd, track_question
from posefield.tracks.track import MAX_PEOPLE, TrackSet
from posefield.tracks.track_question import TracksQuestion

Question = TypeVar("Question", bound=msgspec.Struct)
Script = Mapping[str, Any] | PerformanceQuestion | str | Path
"""Script of a performance, as the body of a request, or the path of a JSON file with one."""

MAX_FRAMES = 10 * MAX_POSES
"""Largest number of frames of a performance."""


@dataclass(frozen=True)
class Clip(ClipAnswer):
    """Clip of a model: `clip`, its motion, and `trust`, its provenance and uncertainty.

    clip.rotations: (F, J, 4), local to the parent joint. clip.root_path: (F, 3), m. clip.skeleton:
    names, parents and offsets, m, of the J joints. clip.rate: frames a second. robot: whose motion
    it is, of a model of a robot.
    """

    def robot_motion(self) -> RobotMotion:
        """Return the motion of the robot's base and hinges, Z up; InvalidField without a robot."""
        robot = robot_clip.require(self.robot, "robot_motion")
        return robot_clip.of(robot).motion(self.clip, "clip", self.loops)

    def save(
        self,
        path: str | Path,
        *,
        unit: LengthUnit | None = None,
        up: UpAxis | None = None,
        body: BodyKind | None = None,
    ) -> tuple[str, ...]:
        """Write a file in the format of the path's suffix; return its warnings.

        Of a robot a name such as walk.mjlab.npz writes a reference motion, in metres with Z up.

        unit, up, body: None for the format's defaults. Names of joints and the kind of root are
        those of the question. Raises UnknownFormat, InvalidField for a convention that the format
        does not allow, and FileError if the file cannot be written.
        """
        encoder = encoder_for(Path(path))
        content = encoder.encode(self, encoder.convention(unit, up, body))
        atomic_files.write(content, Path(path))
        return encoder.noted(self).trust.warnings


@dataclass(frozen=True)
class Performance(PerformanceAnswer):
    """Performance of a script: `clip`, its motion, and `trust`, the report of its segments.

    unit, up, body: of its files, as the script has them.
    """

    unit: LengthUnit | None = None
    up: UpAxis | None = None
    body: BodyKind | None = None

    def save(self, path: str | Path, *, layout: PerformanceLayout = "whole") -> None:
        """Write a file in the format of the path's suffix.

        layout: animations in USD files. Raises as `Clip.save` does.
        """
        encoder = encoder_for(Path(path))
        encode = formats.performance_encoder(encoder, layout)
        convention = encoder.convention(self.unit, self.up, self.body)
        atomic_files.write(encode(self, convention), Path(path))


@dataclass(frozen=True)
class Crowd:
    """Walking crowd of a model, on tracks or random paths, computed as it is saved."""

    synthesizer: Synthesizer
    question: WalkQuestion
    tracks: TrackSet | None = None

    def save(self, path: str | Path) -> Mapping[str, Any]:
        """Write a file by the ending of its path (`crowd_formats`); return the crowd's facts.

        Raises UnknownFormat, InvalidField for a crowd that the model or the limits do not permit,
        and FileError if the file cannot be written.
        """
        path, question = Path(path), self.question
        crowd_formats.endings_of([path], question)
        crowd = track_crowd.of_question(self.synthesizer, question, self.tracks)
        crowd_formats.write(crowd, path, question, self.synthesizer.session.card.roles)
        return crowd.facts


@dataclass(frozen=True)
class Model:
    """A model that is open in this process; `load` opens one."""

    synthesizer: Synthesizer

    def pose(self, times: float | Sequence[float], **fields: Any) -> PoseAnswer[Any]:
        """Return the poses at times (S,), s, from the start of the clip.

        fields: of a PoseQuestion, and controls. The answer has rotations (S, J, 4), root_position
        (S, 3), m, bone_offsets (J, 3), m, and trust.
        """
        moments = [times] if isinstance(times, float | int) else times
        question = decode(PoseQuestion, {**fields, "times": moments})
        return poses.synthesize_poses(self.synthesizer, question)

    def clip(self, **fields: Any) -> Clip:
        """Return a clip. fields: of a ClipQuestion, such as fps, names and root, and controls."""
        answer = clips.synthesize_clip(self.synthesizer, decode(ClipQuestion, fields))
        return Clip(answer.clip, answer.trust, answer.robot, answer.loops)

    def crowd(self, **fields: Any) -> Crowd:
        """Return a crowd of a cyclic model on random paths, or of people who follow tracks.

        fields: of a WalkQuestion; with tracks, which are dicts of id, times (S,), s, positions
        (S, 2), m, x east and y north, and maybe headings (S,), rad, of a TracksQuestion.
        """
        if "tracks" not in fields:
            return Crowd(self.synthesizer, decode(WalkQuestion, fields))
        question = decode(TracksQuestion, fields)
        tracks = track_question.read_tracks(question, MAX_PEOPLE)
        return Crowd(self.synthesizer, question.question(len(tracks.tracks)), tracks)

    def perform(self, script: Script) -> Performance:
        """Return the performance of a script in which this model is the only one."""
        return perform(script, [self])


def load(model: str | Path) -> Model:
    """Return the model of an .onnx file, or the shipped model of a name.

    Raises ModelError for a file that cannot be used, and for an unknown name.
    """
    path = model_registry.file_or_shipped(Path(model))
    if path.is_dir():
        raise ModelError(path, "a folder, expected one .onnx file")
    return Model(next(iter(model_registry.load([path]).models.values())))


def perform(script: Script, models: Iterable[Model] = ()) -> Performance:
    """Return the performance of a script. models: that it may name; the shipped ones if empty.

    Raises QueryError with a pointer into the script, and FileError for a file that cannot be read.
    """
    opened = {model.synthesizer.name: model.synthesizer for model in models}
    registry = ModelRegistry(opened) if opened else model_registry.with_shipped([])
    if isinstance(script, str | Path):
        try:
            content = Path(script).read_bytes()
        except OSError as error:
            raise FileError(script, f"{error.strerror}, expected a script in JSON") from error
        question = json_decoding.decode_question(PerformanceQuestion, content)
    else:
        question = decode(PerformanceQuestion, script)
    answer = composition.perform(resolve_script(question, registry.find), MAX_FRAMES)
    conventions = question.unit, question.up, question.body
    return Performance(answer.clip, answer.trust, answer.held, *conventions)


def decode(form: type[Question], fields: Mapping[str, Any] | Question) -> Question:
    """Return the question of keywords, which may hold NumPy's numbers and arrays.

    Keywords that are no field of a question with controls are controls. Raises FormError.
    """
    if isinstance(fields, Mapping) and "controls" in form.__struct_fields__:
        values = {name: fields[name] for name in fields if name in form.__struct_fields__}
        controls = {name: fields[name] for name in fields if name not in values}
        fields = {**values, "controls": {**values.get("controls", {}), **controls}}
    content = msgspec.json.encode(fields, enc_hook=lambda value: value.tolist())
    return json_decoding.decode_question(form, content)
