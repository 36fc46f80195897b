"""Table of the files of crowds, by the ending of their names."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from posefield.common import atomic_files
from posefield.common.errors import InvalidField, UnknownFormat
from posefield.encode import actor_scene, bone_tables, crowd_size, motion_tables, osi_trace
from posefield.encode.archives import ARROW, NPZ, Format, by_extension
from posefield.motion.clip import CrowdClip, Motions
from posefield.question.motion_question import DEFAULT_BODY
from posefield.question.walk_question import DEFAULT_INSTANCING, WalkQuestion

Roles = Mapping[str, str]


@dataclass(frozen=True)
class CrowdFile(Format):
    """Writer of crowds in one format.

    write: writes a crowd of a model with these roles of its joints to a path, which it need not do
    atomically. beside: whether it writes other files beside the path, and all of them atomically.
    """

    write: Callable[[CrowdClip, Path, Roles], None]
    beside: bool = False


CROWD_FILES = by_extension(
    CrowdFile("npz", NPZ, lambda crowd, path, _: motion_tables.write_npz(crowd, path)),
    CrowdFile("bones.npz", NPZ, lambda crowd, path, _: bone_tables.write_npz(crowd, path)),
    CrowdFile("arrow", ARROW, lambda crowd, path, _: bone_tables.write_arrow(crowd, path)),
    CrowdFile("osi", "application/vnd.asam.osi", osi_trace.write),
    CrowdFile("carla.npz", NPZ, bone_tables.write_carla),
    CrowdFile(
        "sdf", "application/x-sdf", lambda crowd, path, _: actor_scene.write(crowd, path), True
    ),
)
"""Formats of crowds besides USD."""
ENDINGS = (*crowd_size.FILES, *CROWD_FILES)


def ending_of(path: Path) -> str:
    """Return the ending of a crowd's file, the longest that fits; UnknownFormat for another."""
    fitting = [ending for ending in ENDINGS if path.name.endswith(f".{ending}")]
    if not fitting:
        raise UnknownFormat("output", f"{path.name!r} ends in none of {', '.join(ENDINGS)}")
    return max(fitting, key=len)


def endings_of(paths: Sequence[Path], question: WalkQuestion) -> tuple[str, ...]:
    """Return the endings of the files of a crowd.

    Raises as `ending_of` does, and InvalidField for a body or an instancing if none is of USD.
    """
    endings = tuple(map(ending_of, paths))
    for name, default in (("body", None), ("instancing", DEFAULT_INSTANCING)):
        value = getattr(question, name)
        if value != default and CROWD_FILES.keys() >= {*endings}:
            text = f"{value!r}, expected none given: {endings[0]} files carry no {name}"
            raise InvalidField(name, text)
    return endings


def write(crowd: CrowdClip, path: Path, question: WalkQuestion, roles: Roles) -> None:
    """Write a crowd atomically in the format of the path's ending.

    question: has the body and the instancing in USD. roles: of the skeleton's joints. Raises
    UnknownFormat, InvalidField for a crowd that the format cannot have, and FileError.
    """
    form = CROWD_FILES.get(ending_of(path))
    if form is None:
        # usd-core takes 0.12 CPU seconds to import.
        from posefield.encode import crowd_writer

        crowd_writer.write(crowd, path, question.instancing, question.body or DEFAULT_BODY)
    elif form.beside:
        form.write(crowd, path, roles)
    else:
        with atomic_files.replacing(path) as temporary:
            form.write(crowd, temporary, roles)


def write_files(crowd: CrowdClip, paths: list[Path], question: WalkQuestion, roles: Roles) -> None:
    """Write a crowd to several files as `write` does, all or none, of motions computed once.

    A temporary file has the motions meanwhile, half a kilobyte a pose, without facts of feet.
    """
    if len(paths) == 1:
        write(crowd, paths[0], question, roles)
        return
    names = "rotations root_position bone_offsets levels".split() + ["curves"] * bool(crowd.curves)
    with atomic_files.temporary_folder(paths[0]) as folder, (folder / "spool").open("w+b") as file:
        for batch in crowd.batches:
            for name in names:
                np.save(file, getattr(batch, name), allow_pickle=False)
        size = file.tell()
        with atomic_files.together():
            for path in paths:
                file.seek(0)
                left = iter(lambda: file.tell() < size, False)
                batches = (Motions(**{name: np.load(file) for name in names}) for _ in left)
                write(replace(crowd, batches=batches), path, question, roles)
