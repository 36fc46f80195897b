"""Discovery in long recordings: strides against those cut by hand, and motions like one example.

R-precision of an example: the share of its best R matches that are one of the R other cuts of its
action, with half of their time in common at least.
"""

import argparse
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path

import hand_cuts
import numpy as np
from rows import Row, record, table

from posefield_train.discover import family_search, found_clips, motion_features
from posefield_train.discover.motion_features import Span
from posefield_train.discover.recordings import read_recordings

ROOT = Path(__file__).resolve().parents[1]
ACCEPTED, REJECTED = 3, 2
"""Matches that a person accepts and rejects in the first list."""
SAME_STRIDE = 0.8
"""Least common time of a found stride and a cut, as a share of the time of both together."""


def strides(folder: Path) -> list[Row]:
    """Return the figures of strides against those of strides.csv, at 120 frames a second."""
    strides_found = {
        recording.file: [one for one in found_clips.find_strides(recording) if one.travels]
        for recording in read_recordings(folder).recordings
    }
    cuts = hand_cuts.records(folder / "strides.csv")
    differences = []
    for row in cuts:
        first, last = int(row["start_frame"]), int(row["end_frame"])
        for one in strides_found.get(row["file"], []):
            common = min(one.last, last) - max(one.first, first)
            if common > SAME_STRIDE * (max(one.last, last) - min(one.first, first)):
                differences.append((abs(one.first - first), abs(one.last - last)))
    several = sum(map(len, strides_found.values()))
    missed_share = 100.0 * (1.0 - len(differences) / len(cuts))
    note = f"of {len(cuts)} cut by hand; {several} found in all"
    middle, largest = float(np.median(differences)), float(np.percentile(differences, 90))
    return [
        Row("strides: missed", missed_share, "%", note, None, 3.0),
        Row("strides: cuts apart, median", middle, "frames", "120 frames a second", None, 1.0),
        Row(
            "strides: cuts apart, 90th percentile",
            largest,
            "frames",
            f"worst {np.max(differences)}",
            None,
            4.0,
        ),
    ]


def examples(folder: Path) -> list[Row]:
    """Return the figures of each cut of truth.csv as an example."""
    begin = time.process_time()
    recordings = read_recordings(folder / "bvh").recordings
    corpus = motion_features.build_corpus(recordings)
    reading = time.process_time() - begin
    truth = [(cut.action, cut.span) for cut in hand_cuts.read(folder, recordings)]
    begin = time.process_time()
    precisions = defaultdict(list)
    rounds: dict[str, list[float]] = {"first": [], "least sure": []}
    for action, example in truth:
        rest = [span for precision, span in truth if precision == action and span != example]
        similar = _spans(family_search.find_like(corpus, [example], len(rest)))
        right = [one for one in similar if hand_cuts.is_right(one, rest)]
        precisions[action].append(len(right) / len(rest))
        wrong = [one for one in similar if one not in right][:REJECTED]
        for name, accepted in (("first", right[:ACCEPTED]), ("least sure", right[-ACCEPTED:])):
            largest = len(rest) - len(accepted)
            again = family_search.find_like(corpus, [example, *accepted], largest, wrong)
            several = [*accepted, *_spans(again)]
            rounds[name].append(sum(hand_cuts.is_right(one, rest) for one in several) / len(rest))
    spent = time.process_time() - begin
    all_values = [value for precision in precisions.values() for value in precision]
    worst = min(precisions, key=lambda action: np.mean(precisions[action]))
    counts = Counter(action for action, _ in truth)
    note = f"{len(truth)} examples of {len(counts)} actions; worst {worst}, "
    note += f"{100.0 * (1.0 - np.mean(precisions[worst])):.0f} %"
    minutes = sum(len(recording) / recording.rate for recording in recordings) / 60.0
    files_said = f"{minutes:.1f} minutes in {len(recordings)} recordings"
    queries = len(truth) * (1 + 2 * (1 + ACCEPTED))
    accepts = f"{ACCEPTED} accepted, those included, and {REJECTED} rejected"
    return [
        Row("one example: missed by the best R", _missed(all_values), "%", note, None, 12.0),
        *(
            Row(
                f"a second round, the {name} right ones",
                _missed(precision),
                "%",
                accepts,
                None,
                5.0,
            )
            for name, precision in rounds.items()
        ),
        Row("processor time of reading and features", reading, "s", files_said, None, 60.0),
        Row("processor time of an example", 1e3 * spent / queries, "ms", "mean", None, None),
    ]


def _missed(precisions: Sequence[float]) -> float:
    return 100.0 * (1.0 - float(np.mean(precisions)))


def _spans(matches: Sequence[motion_features.Match]) -> list[Span]:
    return [match.span for match in matches]


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder with cmu_walk and hdm05_long, unpacked")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    table_rows = [*strides(options.data / "cmu_walk"), *examples(options.data / "hdm05_long")]
    print(table(table_rows))
    if options.record:
        command = "python benchmarks/discovery.py DATA --record"
        record({"discovered": table_rows}, command, ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
