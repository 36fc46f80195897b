"""Errors of posefield and of other methods on held-out motions, for the results pages.

    python benchmarks/evaluate.py RECIPE [--data FOLDER] [--json FILE]

Prints the table of each protocol that the recipe allows, and writes all figures. `make evaluate`
runs it for every family and summarises the files. Finished folds are kept in build/evaluation, so
that a run that was stopped goes on.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from evaluation import new_performers, protocol
from evaluation.protocol import TRUTH

from posefield.console.progress import ProgressBar
from posefield_train.cli import executors
from posefield_train.evaluate import protocol as held_out
from posefield_train.evaluate import summary
from posefield_train.jobs import PACKAGES, FinishedJobs, Jobs
from posefield_train.source import data_folder, ingest, recipe

KEPT = Path(__file__).parents[1] / "build/evaluation"


def measure(file: Path, data: Path, jobs: Jobs) -> dict[str, Any]:
    """Return the figures of a recipe and print the table of each protocol."""
    family = recipe.read_accepted(file)
    examples, _ = ingest.ingest(family, data)
    results = []
    for name in ([TRUTH] if family.truth else []) + held_out.protocols(examples):
        with ProgressBar(f"{family.name}, {name}") as bar:
            results.append(protocol.run(family, examples, name, jobs, bar.update))
        print(f"{summary.table(results[-1].errors)}\n")
    first, *rest = [result.facts() for result in results]
    performers = new_performers.facts([result.errors for result in results])
    return {**first, **({"performers": performers} if performers else {}), "others": rest}


def main() -> None:
    """Measure a family and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recipe", type=Path, help="recipe file or shipped recipe")
    parser.add_argument("--data", type=Path, help="folder of the motion data")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    file = data_folder.recipe_file(options.recipe, options.data)
    with executors.jobs(None, None) as processes:
        # Folds of these benchmarks hold data classes of their own.
        finished = FinishedJobs(processes, KEPT, (*PACKAGES, "evaluation"))
        figures = measure(file, options.data or file.parent, finished)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
