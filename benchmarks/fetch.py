"""Convert downloaded motion data to what a shipped recipe reads.

    python benchmarks/fetch.py cmu|hdm05 SOURCE_FOLDER OUTPUT_FOLDER

It downloads nothing: the owners' pages are http://mocap.cs.cmu.edu (for the recipe cmu_walk:
subjects 2, 5, 6, 7, 8, 10, 12, 16, 35, 38, 39, 43, 45, 46, 47, 49, 55; five of the walks are of
unknown subjects) and https://resources.mpi-inf.mpg.de/HDM05 (for the recipes of reaches: the cut
clips). SOURCE_FOLDER has the unpacked files, in any subfolders: ASF and AMC, for cmu also BVH.
OUTPUT_FOLDER, for --data of `posefield train`, gets BVH files, the table with the rows whose files
were found, and fetched.json with the SHA-256 of all files.
"""

import argparse
import sys
from pathlib import Path

from recipe_data import cmu_trials, data_sets, hdm05_cuts

from posefield.common.errors import FileError

DATA = {"cmu": (data_sets.CMU, cmu_trials), "hdm05": (data_sets.HDM05, hdm05_cuts)}


def main(words: list[str] | None = None) -> int:
    """Convert a data set; print what is missing on standard error, and return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", choices=[*DATA])
    parser.add_argument("source", type=Path)
    parser.add_argument("output", type=Path)
    options = parser.parse_args(words)
    data, converter = DATA[options.data]
    try:
        fetched = converter.convert(options.source)
        for file, reason in fetched.missing.items():
            print(f"missing: {file}: {reason}", file=sys.stderr)
        for one in fetched.files:
            if one.remark:
                print(f"warning: {one.file}: {one.remark}", file=sys.stderr)
        if not fetched.files:
            missing = len(fetched.missing)
            raise FileError(options.source, f"found none of {missing} clips; see {data.page}")
        facts = data_sets.write(data, fetched, options.output)
    except FileError as fault:
        print(f"fetch: {fault}", file=sys.stderr)
        return 3
    total = len(fetched.files) + len(fetched.missing)
    print(
        f"{options.output / data.folder}: {len(fetched.files)} of {total} motions, {facts['rows']} "
        f"rows of {data.table}; train with --data {options.output}\n{data.terms}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
