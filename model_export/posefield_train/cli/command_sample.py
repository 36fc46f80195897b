"""Command `posefield sample`: procedural motions."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.common.name_suggestion import did_you_mean
from posefield.console.arguments import Json, encoder_for
from posefield.console.output import as_json, written_message
from posefield.console.question_options import parse_controls, with_option_groups
from posefield.question.results import ClipAnswer, Trust

if TYPE_CHECKING:
    from posefield_train.sample.face.face_motion import FaceTrial
    from posefield_train.sample.sample_family import SampleTrial

MOST_CLIPS = 20_000
"""Largest number of clips of one family: as many files as a folder is used with."""


@dataclass(frozen=True)
class NoiseFreeMotion:
    """Noise-free motion in place of a family: whether, at which controls and which frame rate."""

    truth: Annotated[
        bool,
        typer.Option(
            "--truth",
            help="write the noise-free motion of reaching at the controls of --control",
        ),
    ] = False
    control: Annotated[
        list[str] | None,
        typer.Option(
            "--control",
            "-c",
            help="with --truth: value of a control; all are needed; may be repeated",
            metavar="NAME=VALUE",
        ),
    ] = None
    fps: Annotated[float, typer.Option(help="frame rate with --truth, frames a second")] = 120.0


@dataclass(frozen=True)
class FamilySize:
    """Size of the family of reaching: number of clips, and seed of their noise."""

    clips: Annotated[
        int | None,
        typer.Option(help="number of clips of reaching; default: 92", min=1, max=MOST_CLIPS),
    ] = None
    seed: Annotated[
        int | None,
        typer.Option(help="random seed of the noise of reaching; default: 2006", min=0),
    ] = None

    @property
    def given(self) -> list[str]:
        """Return the names of the options that are given."""
        return [each.name for each in fields(self) if getattr(self, each.name) is not None]


@with_option_groups
def sample(
    family: Annotated[
        str,
        typer.Argument(
            help="name of the family: reaching, quadruped, hand or face", metavar="FAMILY"
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="output folder; with --truth, output file")
    ],
    true: NoiseFreeMotion,
    size: FamilySize,
    json: Json = False,
) -> None:
    """Write a procedural family of motions, or its noise-free motion.

    reaching: people who reach, in any number of clips; its noise-free motion exists at any control
    point. quadruped: two animals that walk. hand: two hands that grip. face: a head with a jaw
    and blend shapes.
    """
    from posefield_train.sample import noise_free as truths

    if family not in WRITERS:
        known = ", ".join(WRITERS)
        raise InvalidField(
            "family", f"{family!r}{did_you_mean(family, WRITERS)}, expected one of {known}"
        )
    _check_options(family, true.truth, size.given)
    if not true.truth:
        reaching = family == "reaching"
        path = (
            _write_reaching(output, size.clips, size.seed) if reaching else WRITERS[family](output)
        )
        typer.echo(
            as_json({"recipe": str(path)}) if json else f"{path}: train it with posefield train"
        )
        return
    encode = encoder_for(output).encode
    controls = parse_controls(true.control or [])
    clip = truths.truth_clip(controls, true.fps)
    answer = ClipAnswer(clip, Trust("reaching@truth", controls, clip.duration, 0.0, ()))
    atomic_files.write(encode(answer), output)
    typer.echo(written_message(output, answer, json))


def _check_options(family: str, truth: bool, numbers: list[str]) -> None:
    """Raise InvalidField for an option that reaching alone has, or that --truth does not use.

    numbers: names of the given options of a family's size and noise.
    """
    own = ["truth", *numbers] if truth else numbers
    if own and family != "reaching":
        raise InvalidField(own[0], f"found for {family!r}, expected for reaching only")
    if truth and numbers:
        raise InvalidField(numbers[0], "found with --truth, expected for a family of clips")


def _write_reaching(output: Path, clips: int | None = None, seed: int | None = None) -> Path:
    """Write the procedural family with a progress bar, and return the path of its recipe.

    clips: 92 if None. seed: of the noise; that of the 92 if None.
    """
    from posefield.console.progress import ProgressBar
    from posefield_train.sample import sample_family, sample_files

    count = sample_family.COUNT if clips is None else clips
    own_seed = sample_family.SEED if seed is None else seed
    with ProgressBar("motions", count) as bar:

        def watched() -> "Iterator[SampleTrial]":
            for each in sample_family.samples(count, own_seed):
                bar.advance(1)
                yield each

        return sample_files.write_family(output, watched())


def _write_quadruped(output: Path) -> Path:
    from posefield_train.sample import sample_files
    from posefield_train.sample.figures import quadruped_walk

    return sample_files.write_folder(output, quadruped_walk.files())


def _write_hand(output: Path) -> Path:
    from posefield_train.sample import sample_files
    from posefield_train.sample.figures import hand_grip

    return sample_files.write_folder(output, hand_grip.files())


def _write_face(output: Path) -> Path:
    """Write the procedural face with a progress bar, and return the path of its recipe."""
    from posefield.console.progress import ProgressBar
    from posefield_train.sample.face import face_files, face_motion

    with ProgressBar("motions", face_motion.COUNT) as bar:

        def watched() -> "Iterator[FaceTrial]":
            for each in face_motion.trials():
                bar.advance(1)
                yield each

        return face_files.write_family(output, watched())


WRITERS = {
    "reaching": _write_reaching,
    "quadruped": _write_quadruped,
    "hand": _write_hand,
    "face": _write_face,
}
"""Writers of the procedural families; only the first has a noise-free motion at any point."""
