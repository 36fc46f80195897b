"""Layouts of the files of an export: loose in folders, packed into archives, or a USD library.

Archives contain the files under the paths that they have in folders, so unpacking all archives of
an export gives the same folders. A library is a stage of one character, with layers that contain
only motion.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from posefield.batch.job import (
    ExportedFile,
    ExportJob,
    WorkerInput,
    archive_members,
    open_model_of,
)
from posefield.batch.rows import Row
from posefield.batch.target import ExportTarget, WrittenFile, put_file
from posefield.common.errors import InvalidField, did_you_mean
from posefield.encode import extent
from posefield.encode.archives import ARCHIVE_WRITERS, ArchiveWriter
from posefield.encode.character import Convention
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import joint_roles
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer, SampledClip

ROWS_PER_FOLDER = 1000
"""Files per folder; many more make file systems and file browsers slow."""

ManifestEntry = dict[str, Any]


ChunkWriter = Callable[
    [ExportTarget, int, Iterable[list[ExportedFile]]], tuple[list[ManifestEntry], list[WrittenFile]]
]
"""Write the files of the chunk of a number, which come in batches; return their entries and the
archives that contain them.
"""


@dataclass(frozen=True)
class Layout:
    """Paths and contents of the files of an export.

    chunk: default number of rows in a chunk. write: writes the files of a chunk. encode: returns
    the files of clips; None for the encoder of their format. misfit: returns the reason for which a
    row does not fit this layout, or None. describe: returns further values of a clip's entry.
    complete: returns files about the whole export, from all entries.
    """

    chunk: int
    write: ChunkWriter
    encode: Callable[[Sequence[SampledClip], Convention], list[bytes]] | None = None
    misfit: Callable[[ExportJob, Row[ClipQuestion]], str | None] = lambda job, row: None
    describe: Callable[[ClipAnswer], ManifestEntry] = lambda answer: {}
    complete: Callable[[WorkerInput, Iterable[ManifestEntry]], Iterable[tuple[str, bytes]]] = (
        lambda work, entries: ()
    )


def path(row: int, name: str, extension: str) -> str:
    """Return the path of a row's file, in a folder or inside an archive."""
    return f"clips/{row // ROWS_PER_FOLDER:03d}/{name}.{extension}"


CHARACTER_FOLDER = path(0, "", "").rpartition("/")[0]
"""Folder of the first clips in a target; those of all clips are as deep."""


def write_loose_files(
    target: ExportTarget, number: int, batches: Iterable[list[ExportedFile]]
) -> tuple[list[ManifestEntry], list[WrittenFile]]:
    """Write each file separately."""
    entries = []
    for files in batches:
        target.write([(file.path, file.content) for file in files])
        entries += [file.entry for file in files]
    return entries, []


def archive_chunk_writer(pack: ArchiveWriter) -> ChunkWriter:
    """Return a function that writes one archive per chunk, with its part of the manifest last."""

    def archived(
        target: ExportTarget, number: int, batches: Iterable[list[ExportedFile]]
    ) -> tuple[list[ManifestEntry], list[WrittenFile]]:
        entries: list[ManifestEntry] = []

        def files() -> Iterator[ExportedFile]:
            for batch in batches:
                for file in batch:
                    entries.append(file.entry)
                    yield file

        path = f"clips-{number:06d}.{pack.extension}"
        members = archive_members(files(), f"manifest-{number:06d}.jsonl")
        archive = put_file(target, path, pack.write(members))
        return [{**entry, "archive": path} for entry in entries], [archive]

    return archived


STAGE, LIBRARY_FORMAT = "character.usd", "usdc"


def _library_misfit(job: ExportJob, row: Row[ClipQuestion]) -> str | None:
    """Return the reason for which a row does not fit a library of one character, or None."""
    if row.format != LIBRARY_FORMAT:
        return f"format: {row.format!r}, expected {LIBRARY_FORMAT!r} in a library"
    for name in ("names", "root_bone"):
        value, expected = getattr(row.question, name), getattr(job, name)
        if value != expected:
            return f"{name}: {value!r}, expected {expected!r} as of the library's character"
    return None


def _animation_layers(answers: Sequence[SampledClip], convention: Convention) -> list[bytes]:
    """Return binary layers of the clips' animations, without a character."""
    from posefield.encode import usd_clip

    return usd_clip.animation_usdc(answers, convention)


def _clip_box(answer: ClipAnswer) -> ManifestEntry:
    """Return the corners, m, of a box that contains the character throughout a clip."""
    clip = answer.clip
    box = extent.pose_independent_box(clip.skeleton, clip.translations[0], clip.root_path)
    return {"low": tuple(box[0].tolist()), "high": tuple(box[1].tolist())}


def _library_stage(
    work: WorkerInput, entries: Iterable[ManifestEntry]
) -> Iterator[tuple[str, bytes]]:
    """Yield the stage of a library, at the rate of its first clip."""
    from posefield.encode import usd_library

    job, card = work.job, open_model_of(work).session.card
    keys = ("name", "file", "frames", "fps", "low", "high")
    clips = [usd_library.LibraryEntry(*(entry[key] for key in keys)) for entry in entries]
    skeleton = joint_roles.rename_joints(card.skeleton, card.roles, job.names)
    convention = CLIP_ENCODERS[LIBRARY_FORMAT].convention(job.unit, job.up, job.body)
    curves = [curve.name for curve in card.curves]
    stage = usd_library.library_stage(
        skeleton, convention, clips[0].rate, clips, curves, job.root_bone
    )
    yield STAGE, stage


LAYOUTS = {
    "folder": Layout(256, write_loose_files),
    "library": Layout(
        256, write_loose_files, _animation_layers, _library_misfit, _clip_box, _library_stage
    ),
    **{
        pack.extension: Layout(1000, archive_chunk_writer(pack))
        for pack in ARCHIVE_WRITERS.values()
    },
}


def find_layout(name: str) -> Layout:
    """Return the layout of a name; InvalidField if there is none."""
    if name not in LAYOUTS:
        hint = did_you_mean(name, LAYOUTS)
        raise InvalidField("layout", f"{name!r}{hint}, expected one of {', '.join(LAYOUTS)}")
    return LAYOUTS[name]
