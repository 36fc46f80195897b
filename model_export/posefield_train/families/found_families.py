"""Families of a folder's takes: similar motions and strides, as rows of tables."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from posefield_train.discover import (
    family_quality,
    family_search,
    joined_features,
    motion_features,
    stride_detection,
)
from posefield_train.discover.family_quality import FamilyQuality
from posefield_train.discover.family_search import FEWEST
from posefield_train.discover.motion_features import Corpus
from posefield_train.discover.take_reading import Take
from posefield_train.families import mixed_bodies
from posefield_train.families.body_kinds import BodyKind
from posefield_train.families.family_table import FamilyRow

STRIDE_CLIPS = 5
"""Fewest strides of a family."""


@dataclass(frozen=True)
class FoundFamily:
    """Clips that may be a family.

    kind: motions or strides. rows: the most similar first. example: row that the others are like;
    None for strides. kinds: of the bodies, the most common first. seconds: median duration.
    quality: None for strides. left_out: reason by clip, such as "a.bvh@3.2". reasons: why it is not
    offered.
    """

    kind: str
    rows: tuple[FamilyRow, ...]
    example: FamilyRow | None
    kinds: tuple[BodyKind, ...]
    seconds: float
    quality: FamilyQuality | None
    left_out: Mapping[str, str]
    reasons: tuple[str, ...]


def find_families(
    takes: Sequence[Take],
    kinds: Sequence[BodyKind],
    count: int,
    report: Callable[[int], None] = lambda _: None,
) -> list[FoundFamily]:
    """Return the families of takes, those that are not offered too, and that of strides last.

    count, report: as in `family_search.find_families`.
    """
    corpus = motion_features.build_corpus(takes)
    joined = joined_features.join_features(corpus)
    found = []
    for family in family_search.find_families(corpus, count, report):
        quality = family_quality.assess(joined, family)
        rows = [_row(corpus, member.span, member.cost, kinds) for member in family.members]
        example = _row(corpus, family.example, 0.0, kinds)
        own = FoundFamily(
            "motions", tuple(rows), example, (), family.seconds, quality, {}, quality.reasons
        )
        found.append(_of_one_topology(own, kinds, takes))
    strides = _strides(takes, kinds)
    return found if strides is None else [*found, strides]


def _row(
    corpus: Corpus, span: joined_features.Span, cost: float, kinds: Sequence[BodyKind]
) -> FamilyRow:
    first, last = corpus.frame(span.take, span.start), corpus.frame(span.take, span.end)
    return _clip(corpus.takes[span.take], first, last, cost, kinds)


def _clip(
    take: Take, first: int, last: int, cost: float | None, kinds: Sequence[BodyKind]
) -> FamilyRow:
    # A mirrored copy swaps the bones of both sides, but its performer is that of the recording.
    who = take.recording
    performer = next(kind.performers[who] for kind in kinds if who in kind.performers)
    return FamilyRow(take.file, first, last, performer, take.recording_name, cost)


def _strides(takes: Sequence[Take], kinds: Sequence[BodyKind]) -> FoundFamily | None:
    """Return the strides that travel as a family; None if there are few."""
    found = [
        (take, one) for take in takes for one in stride_detection.find_strides(take) if one.travels
    ]
    if len(found) < STRIDE_CLIPS:
        return None
    rows = [_clip(take, one.first, one.last, None, kinds) for take, one in found]
    seconds = sorted((one.last - one.first) / take.rate for take, one in found)
    own = FoundFamily("strides", tuple(rows), None, (), seconds[len(seconds) // 2], None, {}, ())
    return _of_one_topology(own, kinds, takes)


def _of_one_topology(
    family: FoundFamily, kinds: Sequence[BodyKind], takes: Sequence[Take]
) -> FoundFamily:
    """Return the family with the clips whose bodies share a topology, the others named.

    Without one, the clips of the most common joints remain.
    """
    numbers = {file: at for at, kind in enumerate(kinds) for file in kind.performers}
    by_file = {take.file: take for take in takes}
    counts = Counter(numbers[row.file] for row in family.rows)
    common = [at for at, _ in counts.most_common()]
    if len(common) > 1 and not mixed_bodies.can_share([kinds[at] for at in common]):
        common = common[:1]
    kept, left_out = [], {}
    for row in family.rows:
        whole = by_file[row.file].is_whole(row.first_frame, row.last_frame)
        if numbers[row.file] in common and whole:
            kept.append(row)
        else:
            place = f"{row.file}@{row.first_frame / by_file[row.file].rate:.1f}"
            left_out[place] = "a joint leaps" if not whole else "other joints than most clips"
    reasons = family.reasons
    if len(kept) < FEWEST:
        reasons = (*reasons, f"{len(kept)} clips of one skeleton, expected {FEWEST} or more")
    if len({row.take for row in kept}) < 2:
        reasons = (*reasons, "clips of one take, expected two takes or more")
    # Clips in which a joint leaps may have been all of a kind.
    left = {numbers[row.file] for row in kept} or {common[0]}
    own = tuple(kinds[at] for at in common if at in left)
    return replace(family, rows=tuple(kept), kinds=own, left_out=left_out, reasons=reasons)
