"""Reader of rigs: the skeleton of a character's USD or glTF file, and its roles."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from posefield.common.errors import MotionFileError
from posefield.rigs import rest_joints, rig
from posefield.rigs.rig import Rig

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
GLTF_SUFFIXES = (".glb", ".gltf")
SUFFIXES = (*USD_SUFFIXES, *GLTF_SUFFIXES)
"""Suffixes of the files that are read, in lower case."""
NONE_STATED: Mapping[str, str] = MappingProxyType({})


def read_rig(path: Path, roles: Mapping[str, str] = NONE_STATED) -> Rig:
    """Return the rig of a character's file.

    roles: names of joints by role, or their paths in the file, where they are not to be
    recognised. Raises MotionFileError for a file that is none or cannot be read, without a
    skeleton or with several, without two legs, for scales that are animated, uneven or mirrored,
    and for roles that are not sure, with the way out.
    """
    suffix, source = path.suffix.lower(), str(path)
    if suffix not in SUFFIXES:
        raise MotionFileError(
            source, f"found the suffix {suffix!r}, expected one of {', '.join(SUFFIXES)}"
        )
    _check_readable(path)
    if suffix in USD_SUFFIXES:
        with rest_joints.naming_faults(source, RuntimeError, ValueError, TypeError):
            return _usd_rig(path, source, roles)
    with rest_joints.naming_faults(source, TypeError, AttributeError, LookupError, ValueError):
        return _gltf_rig(path, source, roles)


def _check_readable(path: Path) -> None:
    try:
        path.open("rb").close()
    except OSError as fault:
        raise MotionFileError(path, f"cannot be read: {fault.strerror}") from fault


def _usd_rig(path: Path, source: str, stated: Mapping[str, str]) -> Rig:
    # usd-core takes 0.12 s to import.
    from posefield.rigs import usd_rig

    own = usd_rig.read(path, source)
    roles = rig.find_roles(source, own.rest.skeleton, own.paths, stated)
    place = (own.paths, own.prim, ())
    return Rig(path, "USD", *place, own.rest, roles.guesses, roles.facing, own.notes + roles.notes)


def _gltf_rig(path: Path, source: str, stated: Mapping[str, str]) -> Rig:
    # pygltflib takes 0.1 s to import.
    from posefield.rigs import gltf_rig

    own = gltf_rig.read(path, source)
    paths = tuple(map(str, own.nodes))
    roles = rig.find_roles(source, own.rest.skeleton, paths, stated)
    place = (paths, "", own.skins)
    return Rig(path, "glTF", *place, own.rest, roles.guesses, roles.facing, own.notes + roles.notes)
