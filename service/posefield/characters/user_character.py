"""Character of a user: its rig, and how files refer to it."""

import hashlib
import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from posefield.common.errors import FileError
from posefield.encode.user_rig.rig_files import RigTarget
from posefield.rigs.joints import format_faults
from posefield.rigs.rig import Rig
from posefield.rigs.rig_reader import read_rig

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
    with format_faults.naming_faults(str(path), RuntimeError, ValueError, TypeError, LookupError):
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
        found = Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    except ValueError:  # Another drive of Windows.
        return path.absolute().as_posix()
    # USD searches for paths that do not begin with a dot in other places too.
    return found if found.startswith(".") else f"./{found}"


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
        found = tomllib.loads(content.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as fault:
        raise FileError(path, f"no TOML: {fault}") from fault
    roles = found.get("roles")
    if not isinstance(roles, dict) or not all(isinstance(one, str) for one in roles.values()):
        raise FileError(path, "no table [roles] of joints by role")
    return roles
