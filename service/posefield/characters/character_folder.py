"""Characters of a folder, read once: those that can be used, and why others cannot."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from posefield.characters.user_character import (
    ENDINGS,
    UserCharacter,
    open_character,
    read_roles,
)
from posefield.common.errors import FileError, InvalidField
from posefield.common.name_suggestion import did_you_mean
from posefield.question.motion_question import LEGAL_NAME

FIELD = "character"
MOST_CHARACTERS = 1000
"""Files of a folder that are read."""


@dataclass(frozen=True)
class CharacterFault:
    """File of a folder that cannot be used. reason: in words."""

    file: str
    reason: str


@dataclass(frozen=True)
class CharacterFolder:
    """Characters by name, and files that cannot be used."""

    characters: Mapping[str, UserCharacter] = field(default_factory=dict)
    faults: tuple[CharacterFault, ...] = ()

    @property
    def digest(self) -> bytes:
        """Return a digest of all characters, by which answers with them are cached."""
        found = hashlib.sha256()
        for name, own in self.characters.items():
            found.update(f"{name} {own.digest} {own.target.reference}\n".encode())
        return found.digest()

    def find(self, name: str) -> UserCharacter:
        """Return the character of a name; InvalidField with the nearest name for an unknown one."""
        if name in self.characters:
            return self.characters[name]
        if not self.characters:
            raise InvalidField(
                FIELD, f"{name!r}, expected none given: this service has no characters"
            )
        hint = did_you_mean(name, self.characters)
        known = ", ".join(list(self.characters)[:10])
        more = ", ..." if len(self.characters) > 10 else ""
        raise InvalidField(FIELD, f"no character {name!r}{hint}, expected one of {known}{more}")

    def document(self) -> dict[str, Any]:
        """Return the CharacterList (schema of the contract)."""
        return {
            "characters": [_facts(own) for own in self.characters.values()],
            "faults": [{"file": own.file, "reason": own.reason} for own in self.faults],
        }


EMPTY = CharacterFolder()


def read_folder(folder: Path, prefix: str) -> CharacterFolder:
    """Return the characters of the rigs in a folder.

    A file NAME.toml beside NAME.glb states its roles. prefix: path before the file's name in
    references. A file that cannot be used is a fault and stops no other. Raises FileError for a
    folder that cannot be read or has too many files.
    """
    try:
        files = sorted(own for own in folder.iterdir() if own.suffix.lower() in ENDINGS)
    except OSError as error:
        raise FileError(folder, f"{error.strerror}, expected a folder of characters") from error
    if len(files) > MOST_CHARACTERS:
        raise FileError(folder, f"{len(files)} files, expected at most {MOST_CHARACTERS}")
    found: dict[str, UserCharacter] = {}
    faults = []
    for file in files:
        try:
            found[file.stem] = _read(file, prefix, found)
        except FileError as error:
            # Clients read the reasons: they do not tell where the folder is.
            reason = error.message.replace(f"{folder.resolve()}{os.sep}", "")
            faults.append(CharacterFault(file.name, reason))
    return CharacterFolder(found, tuple(faults))


def _read(file: Path, prefix: str, found: Mapping[str, UserCharacter]) -> UserCharacter:
    if not LEGAL_NAME.fullmatch(file.stem):
        raise FileError(file, f"the name {file.stem!r}, expected letters, digits, '.', '_', '-'")
    if file.stem in found:
        raise FileError(file, f"another file with the name {file.stem!r}, expected one")
    table = file.with_suffix(".toml")
    roles = read_roles(table) if table.exists() else {}
    return open_character(file, f"{prefix}{file.name}", roles)


def _facts(own: UserCharacter) -> dict[str, Any]:
    rig = own.rig
    return {
        "name": own.name,
        "file": own.target.file,
        "format": rig.format,
        "digest": own.digest,
        "joints": len(rig.skeleton),
        "height": own.height,
        "roles": [
            {"role": role, "joint": guess.joint, "confidence": guess.confidence}
            for role, guess in rig.roles.items()
        ],
        "warnings": list(rig.notes),
    }
