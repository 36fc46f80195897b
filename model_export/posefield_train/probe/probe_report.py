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
            "proposed": {name: asdict(found) for name, found in self.proposed.items()},
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
            own = proposals.measure(motion_readers.read(path))
        except FileError as fault:
            faults[path] = fault
            report(count)
            continue
        faulty += [f"{path}: {said}" for said in proposals.faults(own)]
        own = own.without_frames()
        measured[tuple(own.names)] += 1
        whole = measured[tuple(own.names)] <= proposals.MOST_WHOLE
        figures[path] = own if whole else own.with_few_frames()
        report(count)
    if not figures:
        raise next(iter(faults.values()))
    found = report_of(list(figures), list(figures.values()))
    if len(faulty) > SHOWN_FAULTS:
        faulty[SHOWN_FAULTS:] = [f"{len(faulty) - SHOWN_FAULTS} further faults of frames"]
    reasons = {str(path): motion_readers.reason(own, path) for path, own in faults.items()}
    return replace(found, warnings=(*found.warnings, *faulty), refused=reasons)


def report_of(paths: Sequence[Path], figures: Sequence[Figure]) -> ProbeReport:
    """Return the report on the figures of motion files."""
    common, _ = Counter(tuple(each.names) for each in figures).most_common(1)[0]
    usual = [each for each in figures if tuple(each.names) == common]
    up = proposals.propose_up(usual)
    files = tuple(
        FileFacts(str(path), each.file.format, each.frames, each.file.rate)
        for path, each in zip(paths, figures, strict=True)
    )
    proposed = {
        "metres_per_unit": proposals.propose_unit(usual),
        "up": up,
        "fps": _propose_rate(figures),
        "feet": proposals.propose_feet(usual, up.value),
        "facing": proposals.propose_facing(usual, up.value),
        "licence": LICENCE,
    }
    return ProbeReport(files, common, usual[0].guesses, proposed, tuple(_warnings(figures, usual)))


def _propose_rate(figures: Sequence[Figure]) -> Proposal:
    rates = Counter(each.file.rate for each in figures if each.file.rate is not None)
    if not rates:
        return Proposal(None, "none", ("the files state no rate: ask who captured them",))
    said = sorted({each.file.evidence for each in figures if each.file.rate is not None})
    evidence = f"{', '.join(said[:5])} in the files"
    rate, count = rates.most_common(1)[0]
    meant, doubt = motion_file.doubted_rate(rate)
    if doubt:
        return Proposal(meant, "low" if meant else "none", (evidence, doubt))
    if count < len(figures):
        counted = ", ".join(f"{count} files at {each:g}" for each, count in rates.most_common(5))
        return Proposal(rate, "medium", (evidence, counted))
    return Proposal(rate, "certain", (evidence,))


def _warnings(figures: Sequence[Figure], usual: Sequence[Figure]) -> list[str]:
    """Return what keeps the files from being trained together, and joints that hint at damage."""
    found = ingest.reader_notes({each.file.source: each.file for each in figures})
    if len(usual) < len(figures):
        odd = next(each for each in figures if each.names != usual[0].names)
        differ = sorted(set(odd.names) ^ set(usual[0].names))[:6]
        found.append(
            f"{len(figures) - len(usual)} of {len(figures)} files have other joints, such as "
            f"{odd.file.source} ({', '.join(differ) or 'another order'}): one model needs one "
            "skeleton"
        )
    found += _mixed_settings(usual)
    still = [each for each in usual if not each.moves[0] and any(each.moves)]
    if still:
        mover = still[0].names[still[0].moves.index(True)]
        beside = [
            name
            for name, parent in zip(still[0].names, still[0].file.skeleton.parents, strict=True)
            if parent == 0 and name != mover
        ]
        then = f"training takes {mover!r} as the root"
        if beside:
            then += f" where motion.drop_joints = {beside[:6]} leaves out what is beside it"
        found.append(f"the root {still[0].names[0]!r} stays in place while {mover!r} moves: {then}")
    stretching = [each for each in usual if any(each.moves[1:])]
    if stretching and not still:
        found.append(
            f"{len(stretching)} of {len(usual)} files have bones whose length changes; training "
            "keeps their mean"
        )
    return found


def _mixed_settings(usual: Sequence[Figure]) -> list[str]:
    """Return the warnings on files in another unit, or with another up axis, than most."""
    found = []
    legs = {each.file.source: leg for each in usual if (leg := each.leg_length())}
    middle = float(np.median(list(legs.values()))) if legs else 0.0
    least = OTHER_UNIT
    odd = [own for own, leg in legs.items() if max(leg, middle) > least * min(leg, middle)]
    if odd:
        found.append(
            f"{len(odd)} of {len(usual)} files are in another unit, such as {odd[0]}, whose legs "
            f"are {legs[odd[0]]:.4g} units long, and {middle:.4g} in the median: a recipe has one"
        )
    axes = {each.file.source: proposals.propose_up([each]) for each in usual}
    sure = {own: axis.value for own, axis in axes.items() if axis.confidence in ("certain", "high")}
    counts = Counter(sure.values()).most_common()
    if len(counts) > 1:
        other = next(own for own, axis in sure.items() if axis != counts[0][0])
        found.append(
            f"files have different up axes, such as {sure[other]} in {other} and {counts[0][0]} in "
            f"{counts[0][1]} files: a recipe has one"
        )
    return found


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
    for name, found in report.proposed.items():
        lines.append(f"{name:<15} {_value(name, found)} (confidence: {found.confidence})")
        lines += [f"{'':<18}{said}" for said in found.evidence if with_evidence]
    return [*lines, *(f"warning: {said}" for said in report.warnings)]


def _roles(report: ProbeReport) -> str:
    sure = {role: guess for role, guess in report.guesses.items() if guess.is_sure}
    return ", ".join(
        f"{role} = {guess.joint} ({guess.confidence:.2f})" for role, guess in sure.items()
    )


def _value(name: str, found: Proposal) -> str:
    if found.value is None or found.value == []:
        return "unknown"
    is_list, is_number = (isinstance(found.value, kind) for kind in (list, float))
    shown = ", ".join(found.value) if is_list else f"{found.value:{'.7g' if is_number else ''}}"
    return f"{shown}{UNITS.get(name, '')}"


def _span(values: Sequence[float], form: str) -> str:
    low, high = f"{values[0]:{form}}", f"{values[-1]:{form}}"
    return low if low == high else f"{low} to {high}"
