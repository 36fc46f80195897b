"""Crowds as a file and a folder beside it."""

import re
from pathlib import Path

from service.encode.crowd import package
from service.motion import files
from service.motion.crowd import CrowdClip
from service.motion.errors import FileError

OURS = re.compile(r"(m\d{5,}|character|summary)\.usdc")


def write(crowd: CrowdClip, path: Path, instanced: bool) -> None:
    """Write a crowd's file and folder atomically, replacing an earlier crowd.

    Raises FileError if the folder contains other files than a crowd's layers, which would be lost.
    """
    folder = path.with_name(f"{path.stem}_clips")
    _ours(folder)
    with files.replacing_pair(path, folder) as (entry, inside):
        entry.write_bytes(package.entry(crowd, instanced, folder.name))
        for name, content in package.parts(crowd):
            (inside / name).write_bytes(content)


def _ours(folder: Path) -> None:
    found = [folder] if folder.is_file() else sorted(folder.glob("*"))
    for path in found:
        if not OURS.fullmatch(path.name):
            raise FileError(path, "in the way; expected nothing here but an earlier crowd's layers")
