"""Report on motion files: what is known, what is proposed, and what stays unknown."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from posefield.common.errors import FileError
from posefield.roles import joint_recognition
from posefield.roles.joint_recognition import RoleGuess
from posefield_train.probe import proposals
from posefield_train.probe.proposals import Figure, Proposal
from posefield_train.source import ingest, motion_file, motion_readers
from posefield_train.source.skeleton_checks import OTHER_UNIT

LICENCE = Proposal(None, "none", ("motion files state no licence: ask their author",))
SHOWN_JOINTS, SHOWN_FAULTS = 40, 20


@dataclass(frozen=True)
class FileFacts:
    """Format, frames and rate of a motion file; rate None if it states none."""

    file: str
    format: str
    frames: int
    fps: float | None

    @property
    def seconds(self) -> float | None:
        """Return the duration of the motion, s; None without a rate."""
        return None if self.fps is None else (self.frames - 1) / self.fps


@dataclass(frozen=True)
class ProbeReport:
    """Findings about motion files.

    joints: those of most files. guesses: joints by role with confidence. proposed: by name.
    refused: reason by file that was not read.
    """

    files: tuple[FileFacts, ...]
    joints: tuple[str, ...]
    guesses: dict[str, RoleGuess]
    proposed: dict[str, Proposal]
    warnings: tuple[str, ...]
    refused: dict[str, str] = field(default_factory=dict)

    @property
    def roles(self) -> dict[str, str]:
        """Return the joint of each role that needs no confirmation."""
        return joint_recognition.sure_roles(self.guesses)

    @property
    def asked(self) -> dict[str, RoleGuess]:
        """Return the guesses that have to be confirmed in the recipe, by role."""
        return {role: guess for role, guess in self.guesses.items() if not guess.is_sure}

    def facts(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        return {
            "files": [{**asdict(one), "seconds": one.seconds} for one in self.files],
            "joints": list(self.joints),
            "roles": self.roles,
            "role_confidence": {role: asdict(guess) for role, guess in self.guesses.items()},
            "proposed": {name: asdict(proposal) for name, proposal in self.proposed.items()},
            "warnings": list(self.warnings),
            "refused": self.refused,
        }


def probe(paths: Sequence[Path], report: Callable[[int], None] = lambda _: None) -> ProbeReport:
    """Return the report on motion files.

    report: called with the number of files that are read. A file that cannot be read is refused
    with its reason; FileError if none is left.
    """
    figures: dict[Path, Figure] = {}
    faults: dict[Path, FileError] = {}
    measured: Counter[tuple[str, ...]] = Counter()
    faulty: list[str] = []
    for count, path in enumerate(paths, 1):
        try:
            figure = proposals.measure(motion_readers.read(path))
        except FileError as fault:
            faults[path] = fault
            report(count)
            continue
        faulty += [f"{path}: {fault_text}" for fault_text in proposals.faults(figure)]
        figure = figure.without_frames()
        measured[tuple(figure.names)] += 1
        keeps_all = measured[tuple(figure.names)] <= proposals.MOST_WHOLE
        figures[path] = figure if keeps_all else figure.with_few_frames()
        report(count)
    if not figures:
        raise next(iter(faults.values()))
    result = report_of(list(figures), list(figures.values()))
    if len(faulty) > SHOWN_FAULTS:
        faulty[SHOWN_FAULTS:] = [f"{len(faulty) - SHOWN_FAULTS} further faults of frames"]
    reasons = {str(path): motion_readers.reason(figure, path) for path, figure in faults.items()}
    return replace(result, warnings=(*result.warnings, *faulty), refused=reasons)


def report_of(paths: Sequence[Path], figures: Sequence[Figure]) -> ProbeReport:
    """Return the report on the figures of motion files."""
    common, _ = Counter(tuple(figure.names) for figure in figures).most_common(1)[0]
    alike = [figure for figure in figures if tuple(figure.names) == common]
    up = proposals.propose_up(alike)
    files = tuple(
        FileFacts(str(path), figure.file.format, figure.frames, figure.file.rate)
        for path, figure in zip(paths, figures, strict=True)
    )
    proposed = {
        "metres_per_unit": proposals.propose_unit(alike),
        "up": up,
        "fps": _propose_rate(figures),
        "feet": proposals.propose_feet(alike, up.value),
        "facing": proposals.propose_facing(alike, up.value),
        "licence": LICENCE,
    }
    return ProbeReport(files, common, alike[0].guesses, proposed, tuple(_warnings(figures, alike)))


def _propose_rate(figures: Sequence[Figure]) -> Proposal:
    rates = Counter(figure.file.rate for figure in figures if figure.file.rate is not None)
    if not rates:
        return Proposal(None, "none", ("the files state no rate: ask who captured them",))
    evidences = sorted({figure.file.evidence for figure in figures if figure.file.rate is not None})
    evidence = f"{', '.join(evidences[:5])} in the files"
    rate, count = rates.most_common(1)[0]
    meant, doubt = motion_file.doubted_rate(rate)
    if doubt:
        return Proposal(meant, "low" if meant else "none", (evidence, doubt))
    if count < len(figures):
        counted = ", ".join(
            f"{count} files at {figure:g}" for figure, count in rates.most_common(5)
        )
        return Proposal(rate, "medium", (evidence, counted))
    return Proposal(rate, "certain", (evidence,))


def _warnings(figures: Sequence[Figure], alike: Sequence[Figure]) -> list[str]:
    """Return what keeps the files from being trained together, and joints that hint at damage."""
    warnings = ingest.reader_notes({figure.file.source: figure.file for figure in figures})
    if len(alike) < len(figures):
        odd = next(figure for figure in figures if figure.names != alike[0].names)
        differ = sorted(set(odd.names) ^ set(alike[0].names))[:6]
        warnings.append(
            f"{len(figures) - len(alike)} of {len(figures)} files have other joints, such as "
            f"{odd.file.source} ({', '.join(differ) or 'another order'}): one model needs one "
            "skeleton"
        )
    warnings += _mixed_settings(alike)
    still = [figure for figure in alike if not figure.moves[0] and any(figure.moves)]
    if still:
        mover = still[0].names[still[0].moves.index(True)]
        siblings = [
            name
            for name, parent in zip(still[0].names, still[0].file.skeleton.parents, strict=True)
            if parent == 0 and name != mover
        ]
        then = f"training takes {mover!r} as the root"
        if siblings:
            then += f" where motion.drop_joints = {siblings[:6]} leaves out what is beside it"
        warnings.append(
            f"the root {still[0].names[0]!r} stays in place while {mover!r} moves: {then}"
        )
    stretching = [figure for figure in alike if any(figure.moves[1:])]
    if stretching and not still:
        warnings.append(
            f"{len(stretching)} of {len(alike)} files have bones whose length changes; training "
            "keeps their mean"
        )
    return warnings


def _mixed_settings(alike: Sequence[Figure]) -> list[str]:
    warnings = []
    legs = {figure.file.source: leg for figure in alike if (leg := figure.leg_length())}
    middle = float(np.median(list(legs.values()))) if legs else 0.0
    limit = OTHER_UNIT
    odd = [source for source, leg in legs.items() if max(leg, middle) > limit * min(leg, middle)]
    if odd:
        warnings.append(
            f"{len(odd)} of {len(alike)} files are in another unit, such as {odd[0]}, whose legs "
            f"are {legs[odd[0]]:.4g} units long, and {middle:.4g} in the median: a recipe has one"
        )
    axes = {figure.file.source: proposals.propose_up([figure]) for figure in alike}
    sure = {
        source: axis.value
        for source, axis in axes.items()
        if axis.confidence in ("certain", "high")
    }
    counts = Counter(sure.values()).most_common()
    if len(counts) > 1:
        other = next(source for source, axis in sure.items() if axis != counts[0][0])
        warnings.append(
            f"files have different up axes, such as {sure[other]} in {other} and {counts[0][0]} in "
            f"{counts[0][1]} files: a recipe has one"
        )
    return warnings


UNITS = {"metres_per_unit": " m", "fps": " frames a second", "facing": " degrees"}


def text(report: ProbeReport) -> str:
    """Return the report for people."""
    frames = sorted(one.frames for one in report.files)
    seconds = sorted(one.seconds for one in report.files if one.seconds is not None)
    formats = ", ".join(sorted({one.format for one in report.files}))
    joints = ", ".join(report.joints[:SHOWN_JOINTS])
    more = f" and {len(report.joints) - SHOWN_JOINTS} more"
    lines = [
        f"{len(report.files)} {formats} {'file' if len(report.files) == 1 else 'files'}, "
        f"{_span(frames, 'd')} frames, {_span(seconds, '.2f') if seconds else 'unknown'} s",
        f"joints ({len(report.joints)}): {joints}"
        f"{more if len(report.joints) > SHOWN_JOINTS else ''}",
        f"roles by name: {_roles(report) or 'none recognised'}",
        *(
            f"role to confirm: {role} = {guess.joint} (confidence {guess.confidence:.2f}: "
            f"{'; '.join(guess.reasons)})"
            for role, guess in report.asked.items()
        ),
    ]
    return "\n".join([*lines, *summary(report, with_evidence=True)])


def summary(report: ProbeReport, with_evidence: bool = False) -> list[str]:
    """Return lines with the proposals and the warnings."""
    lines = []
    for name, proposal in report.proposed.items():
        lines.append(f"{name:<15} {_value(name, proposal)} (confidence: {proposal.confidence})")
        lines += [f"{'':<18}{sentence}" for sentence in proposal.evidence if with_evidence]
    return [*lines, *(f"warning: {sentence}" for sentence in report.warnings)]


def _roles(report: ProbeReport) -> str:
    sure = {role: guess for role, guess in report.guesses.items() if guess.is_sure}
    return ", ".join(
        f"{role} = {guess.joint} ({guess.confidence:.2f})" for role, guess in sure.items()
    )


def _value(name: str, proposal: Proposal) -> str:
    if proposal.value is None or proposal.value == []:
        return "unknown"
    is_list, is_number = (isinstance(proposal.value, kind) for kind in (list, float))
    text = (
        ", ".join(proposal.value) if is_list else f"{proposal.value:{'.7g' if is_number else ''}}"
    )
    return f"{text}{UNITS.get(name, '')}"


def _span(values: Sequence[float], form: str) -> str:
    low, high = f"{values[0]:{form}}", f"{values[-1]:{form}}"
    return low if low == high else f"{low} to {high}"
