"""Characters of users: their rigs, how files refer to them, and those of a folder, read once."""

import hashlib
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from posefield.common.errors import FileError, InvalidField, did_you_mean
from posefield.encode.user_rig.rig_files import RigTarget
from posefield.question.motion_question import LEGAL_NAME
from posefield.rigs import rest_joints
from posefield.rigs.rig import Rig, read_rig

MOST_ROLES_BYTES = 128_000
ENDINGS = (".usd", ".usda", ".usdc", ".usdz", ".glb")
"""Endings of files with a rig."""


@dataclass(frozen=True)
class UserCharacter:
    """Character of a user's file.

    digest: SHA-256 of the file, of the files that it refers to as far as its rig and the extent of
    its meshes depend on them, and of the roles that were stated. target: rig, and the path by which
    written files refer to it.
    """

    name: str
    digest: str
    target: RigTarget

    @property
    def rig(self) -> Rig:
        """Return the rig of the file."""
        return self.target.rig

    @property
    def facts(self) -> tuple[str, ...]:
        """Return name, digest and reference: all that determines files, besides the motion."""
        return self.name, self.digest, self.target.reference

    @property
    def height(self) -> float:
        """Return the height of the joints at rest, m."""
        joints = self.rig.skeleton
        return float(np.ptp(joints.at_rest(joints.offsets)[:, 1]))


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
    with rest_joints.naming_faults(str(path), RuntimeError, ValueError, TypeError, LookupError):
        target = RigTarget.of(rig, path, reference)
    if target.stage is not None:
        # Meshes of files that this one refers to decide the extent.
        digest.update(np.ascontiguousarray(target.stage.radii).tobytes())
    return UserCharacter(path.stem, digest.hexdigest(), target)


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
    if not isinstance(roles, dict) or not all(isinstance(one, str) for one in roles.values()):
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
            checksum.update(f"{name} {character.digest} {character.target.reference}\n".encode())
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
        more = ", ..." if len(self.characters) > 10 else ""
        raise InvalidField(FIELD, f"no character {name!r}{hint}, expected one of {names}{more}")

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
        "file": character.target.file,
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
