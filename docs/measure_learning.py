"""Write docs/results/learning.json: errors after suggested and after random captures.

python docs/measure_learning.py

It trains 72 models of the procedural family. Run docs/generate.py afterwards.
"""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path

from posefield_train.cli import executors
from posefield_train.evaluate import learning_curves

TARGET = Path(__file__).parent / "results/learning.json"
MACHINE = "any: the errors do not depend on the machine"


def main() -> None:
    """Measure the learning curves and write them."""
    with executors.jobs(None, None) as jobs:
        curve = learning_curves.measure_curves(jobs, _report)
    found = {
        "command": "python docs/measure_learning.py",
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "machine": MACHINE,
        "learning": learning_curves.facts(curve),
    }
    TARGET.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def _report(done: int, total: int) -> None:
    print(f"{done} of {total}", file=sys.stderr)


if __name__ == "__main__":
    main()
