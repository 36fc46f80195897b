"""Characters of users: their rigs, how files refer to them, and those of a folder, read once."""

import hashlib
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from posefield.common.errors import FileError, InvalidField, did_you_mean
from posefield.common.units import LengthUnit, UpAxis
from posefield.encode import glb
from posefield.encode.character import METRES, Convention
from posefield.encode.formats import ClipEncoder
from posefield.motion import root_bone
from posefield.motion.clip import Clip
from posefield.question.motion_question import LEGAL_NAME, BodyKind, ClipQuestion
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.results import SampledClip
from posefield.rigs import rest_joints
from posefield.rigs.rig import Rig, read_rig

if TYPE_CHECKING:
    from posefield.encode.rig_layer import RigStage

MOST_ROLES_BYTES = 128_000
ENDINGS = (".usd", ".usda", ".usdc", ".usdz", ".glb")
"""Endings of files with a rig."""


LAYERS = ("usda", "usdc", "usdz")
"""Formats of USD."""
TABLES = ("json", "npz", "arrow", "msgpack")
"""Formats of numbers, which hold the curves of the model beside the joints."""


class FileAxes(Protocol):
    """Question with the unit, up axis and body of its files."""

    @property
    def unit(self) -> LengthUnit | None:
        """Return the unit of length; None for the format's."""

    @property
    def up(self) -> UpAxis | None:
        """Return the up axis; None for the format's."""

    @property
    def body(self) -> BodyKind | None:
        """Return the body; None for the format's."""


@dataclass(frozen=True)
class UserCharacter:
    """Character of a user's file, for which files of motions are written.

    digest: SHA-256 of the file, of the files that it refers to as far as its rig and the extent of
    its meshes depend on them, and of the roles that were stated. file: its name. reference: path by
    which USD files refer to it. stage: place of its skeleton in a USD file; None for glTF.
    """

    name: str
    digest: str
    rig: Rig
    file: str
    reference: str
    stage: "RigStage | None"

    @property
    def facts(self) -> tuple[str, ...]:
        """Return name, digest and reference: all that determines files, besides the motion."""
        return self.name, self.digest, self.reference

    @property
    def height(self) -> float:
        """Return the height of the joints at rest, m."""
        joints = self.rig.skeleton
        return float(np.ptp(joints.at_rest(joints.offsets)[:, 1]))

    @property
    def has_floor_root(self) -> bool:
        """Return whether the root is a joint above the hips, near the floor at rest."""
        heights = self.rig.skeleton.at_rest(self.rig.skeleton.offsets)[:, 1]
        hips = self.rig.joints["hips"]
        return hips > 0 and bool(np.ptp(heights[[0, hips]]) > 0.8 * (heights[hips] - heights.min()))

    def check(self, question: ClipQuestion | PerformanceQuestion) -> None:
        """Raise InvalidField for what no file of a user's character holds."""
        if question.names != "own":
            raise InvalidField(
                "names",
                f"{question.names!r} with a character, expected 'own': joints have the names of "
                "its file",
            )
        if question.root == "bone" and not self.rig.joints["hips"]:
            raise InvalidField(
                "root",
                f"'bone' with a character, expected one with a joint above the hips: {self.file} "
                "has none",
            )
        if isinstance(question, ClipQuestion) and question.joint_sigma:
            raise InvalidField(
                "joint_sigma",
                "true with a character, expected false: sigma is of the joints of the model",
            )

    def convention(self, form: ClipEncoder, axes: FileAxes) -> Convention:
        """Return the convention of files in a format.

        Raises InvalidField for a body, for a package, and for another unit or up axis than that of
        the character's file.
        """
        if axes.body is not None:
            raise InvalidField(
                "body",
                f"{axes.body!r} with a character, expected none given: the body is in its file",
            )
        if form.of_robots:
            raise InvalidField(
                "character",
                f"a character with the format {form.extension}, expected none given: the file "
                "holds angles of the robot's hinges",
            )
        if form.extension == "usdz" and self.stage is not None:
            raise InvalidField(
                "character",
                "a USD file with the format usdz, expected usda or usdc: a package holds all its "
                f"files, and {self.file} is referred to, not copied",
            )
        convention = form.convention(axes.unit, axes.up)
        if form.extension not in LAYERS:
            return convention
        character_axes = METRES
        if self.stage is not None:
            character_axes = Convention(self.rig.rest.metres_per_unit, self.rig.rest.up)
        if axes.unit is not None and convention.metres_per_unit != character_axes.metres_per_unit:
            raise InvalidField("unit", f"{axes.unit!r}, {self._expected(character_axes)}")
        if axes.up is not None and convention.up != character_axes.up:
            raise InvalidField("up", f"{axes.up!r}, {self._expected(character_axes)}")
        return character_axes

    def _expected(self, character_axes: Convention) -> str:
        return (
            f"expected none given: the layer has the unit, {character_axes.metres_per_unit:g} m, "
            f"and the up axis, {character_axes.up}, of the character {self.file}"
        )

    def notes(self, form: ClipEncoder, clip: Clip) -> tuple[str, ...]:
        """Return a sentence for each thing that a file in a format lacks."""
        notes = []
        if form.extension in LAYERS and self.stage is None:
            notes.append(
                f"USD cannot refer to glTF files: the layer has the skeleton of {self.file} "
                "without its skin; glb binds to the file by the names of its joints"
            )
        if form.extension in LAYERS and self.stage is not None:
            notes += self.stage.notes
        if form.extension == "glb":
            notes.append(
                "glTF cannot refer to the skin of another file: this one has the animation alone, "
                f"which binds to {self.file} by the names of its joints"
            )
        curves = clip.curves
        if curves is not None and form.has_curves and form.extension not in TABLES:
            notes.append(
                f"files of a character in {form.extension} carry no curves: {len(curves.curves)} "
                f"are left out ({', '.join(curves.names)}); {', '.join(TABLES)} have them"
            )
        return tuple(notes)

    def encode(self, form: ClipEncoder, answer: SampledClip, convention: Convention) -> bytes:
        """Return the file of a motion of the rig's skeleton, in the convention of `convention`."""
        if answer.clip.root_bone and form.extension not in TABLES:
            clip = root_bone.move_root(answer.clip, self.rig.joints["hips"])
            answer = SampledClip(clip, answer.trust)
        if form.extension in LAYERS:
            # usd-core takes 0.12 CPU seconds to import.
            from posefield.encode import layers, usd_clip

            layer = self._layer(answer)
            if form.extension == "usda":
                return bytes(layer.ExportToString(), "utf-8")
            binary = layers.crate_bytes(layer)
            return binary if form.extension == "usdc" else usd_clip.usdz_package(binary)
        if form.extension == "glb":
            rest = self.rig.rest if self.stage is None else self.rig.rest.in_metres()
            return glb.rig_animation(answer, rest)
        return form.encode(answer, replace(convention, body="none"))

    def _layer(self, answer: SampledClip) -> Any:
        from posefield.encode import rig_layer

        if self.stage is None:
            return rig_layer.skeleton_layer(answer, self.rig.rest)
        return rig_layer.referring_layer(answer, self.rig.rest, self.stage, self.reference)


def open_character(
    path: Path, reference: str, roles: Mapping[str, str] | None = None
) -> UserCharacter:
    """Return the character of a file.

    reference: path by which written files refer to it. roles: stated joints by role. Raises
    FileError for a file that cannot be read, MotionFileError for one without a usable rig.
    """
    stated = dict(roles or {})
    digest = hashlib.sha256(_content(path))
    digest.update(repr(sorted(stated.items())).encode())
    rig = read_rig(path, stated)
    rest = rig.rest
    for numbers in (rest.rotations, rest.translations, rest.scales):
        digest.update(np.ascontiguousarray(numbers).tobytes())
    stage = None
    if rig.format == "USD":
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.encode import rig_layer

        with rest_joints.naming_faults(str(path), RuntimeError, ValueError, TypeError, LookupError):
            stage = rig_layer.read_stage(path, rig.skeleton_path, rig.joint_paths)
        # Meshes of files that this one refers to decide the extent.
        digest.update(np.ascontiguousarray(stage.radii).tobytes())
    return UserCharacter(path.stem, digest.hexdigest(), rig, path.name, reference, stage)


def _content(path: Path) -> bytes:
    if path.suffix.lower() not in ENDINGS:
        raise FileError(path, f"no file of a character, expected one of {', '.join(ENDINGS)}")
    try:
        return path.read_bytes()
    except OSError as fault:
        raise FileError(path, f"{fault.strerror}, expected the file of a character") from fault


def relative_reference(path: Path, folder: Path) -> str:
    """Return the path by which files in a folder refer to a file."""
    try:
        relative = Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    except ValueError:  # Another drive of Windows.
        return path.absolute().as_posix()
    # USD searches for paths that do not begin with a dot in other places too.
    return relative if relative.startswith(".") else f"./{relative}"


def read_roles(path: Path) -> dict[str, str]:
    """Return the table [roles] of a TOML file, such as a recipe: joints by role.

    Raises FileError for a file without it.
    """
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise FileError(path, f"{fault.strerror}, expected a TOML file with roles") from fault
    if len(content) > MOST_ROLES_BYTES:
        raise FileError(path, f"{len(content)} bytes, expected at most {MOST_ROLES_BYTES}")
    try:
        content_roles = tomllib.loads(content.decode("utf-8-sig"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as fault:
        raise FileError(path, f"no TOML: {fault}") from fault
    roles = content_roles.get("roles")
    if not isinstance(roles, dict) or not all(isinstance(joint, str) for joint in roles.values()):
        raise FileError(path, "no table [roles] of joints by role")
    return roles


FIELD = "character"
MOST_CHARACTERS = 1000
"""Files of a folder that are read."""


@dataclass(frozen=True)
class CharacterFolder:
    """Characters by name, and the reason by file for files that cannot be used."""

    characters: Mapping[str, UserCharacter] = field(default_factory=dict)
    faults: Mapping[str, str] = field(default_factory=dict)

    @property
    def digest(self) -> bytes:
        """Return a digest of all characters, by which answers with them are cached."""
        checksum = hashlib.sha256()
        for name, character in self.characters.items():
            checksum.update(f"{name} {character.digest} {character.reference}\n".encode())
        return checksum.digest()

    def find(self, name: str) -> UserCharacter:
        """Return the character of a name; InvalidField with the nearest name for an unknown one."""
        if name in self.characters:
            return self.characters[name]
        if not self.characters:
            raise InvalidField(
                FIELD, f"{name!r}, expected none given: this service has no characters"
            )
        hint = did_you_mean(name, self.characters)
        names = ", ".join(list(self.characters)[:10])
        ellipsis = ", ..." if len(self.characters) > 10 else ""
        raise InvalidField(FIELD, f"no character {name!r}{hint}, expected one of {names}{ellipsis}")

    def document(self) -> dict[str, Any]:
        """Return the CharacterList (schema of the contract)."""
        return {
            "characters": [_facts(character) for character in self.characters.values()],
            "faults": [{"file": file, "reason": reason} for file, reason in self.faults.items()],
        }


EMPTY = CharacterFolder()


def read_folder(folder: Path, prefix: str) -> CharacterFolder:
    """Return the characters of the rigs in a folder.

    A file NAME.toml beside NAME.glb states its roles. prefix: path before the file's name in
    references. A file that cannot be used is a fault and stops no other. Raises FileError for a
    folder that cannot be read or has too many files.
    """
    try:
        files = sorted(child for child in folder.iterdir() if child.suffix.lower() in ENDINGS)
    except OSError as error:
        raise FileError(folder, f"{error.strerror}, expected a folder of characters") from error
    if len(files) > MOST_CHARACTERS:
        raise FileError(folder, f"{len(files)} files, expected at most {MOST_CHARACTERS}")
    characters: dict[str, UserCharacter] = {}
    faults: dict[str, str] = {}
    for file in files:
        try:
            characters[file.stem] = _read(file, prefix, characters)
        except FileError as error:
            # Clients read the reasons: they do not tell where the folder is.
            reason = error.message.replace(f"{folder.resolve()}{os.sep}", "")
            faults[file.name] = reason
    return CharacterFolder(characters, faults)


def _read(file: Path, prefix: str, characters: Mapping[str, UserCharacter]) -> UserCharacter:
    if not LEGAL_NAME.fullmatch(file.stem):
        raise FileError(file, f"the name {file.stem!r}, expected letters, digits, '.', '_', '-'")
    if file.stem in characters:
        raise FileError(file, f"another file with the name {file.stem!r}, expected one")
    table = file.with_suffix(".toml")
    roles = read_roles(table) if table.exists() else {}
    return open_character(file, f"{prefix}{file.name}", roles)


def _facts(character: UserCharacter) -> dict[str, Any]:
    rig = character.rig
    return {
        "name": character.name,
        "file": character.file,
        "format": rig.format,
        "digest": character.digest,
        "joints": len(rig.skeleton),
        "height": character.height,
        "roles": [
            {"role": role, "joint": guess.joint, "confidence": guess.confidence}
            for role, guess in rig.roles.items()
        ],
        "warnings": list(rig.notes),
    }
