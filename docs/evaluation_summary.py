"""Write docs/results/evaluation: the figures of benchmarks/evaluate.py that pages show.

python docs/evaluation_summary.py build/evaluation/results

Run docs/generate.py afterwards.
"""

import json
import sys
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))

from rows import compact

TARGET = Path(__file__).parent / "results/evaluation"
PROTOCOL = ("protocol", "clips", "sigma_ratio", "support", "feet", "takes", "performers")
METHOD = ("relative_cm", "global_cm", "effector_cm")
ENDS = ("peak_ratio", "worst_peak_ratio", "first_frames_ratio", "last_frames_ratio")
MOVEMENT = ("duration_error", "acceleration_ratio", *ENDS, "skate_ratio", "exact")
POOLED = ("relative", "global", "effector")
PEER = ("posefield", "error", "standard_error")


def main(folder: Path) -> None:
    """Summarise each file of a folder."""
    for file in sorted(folder.glob("*.json")):
        found = json.loads(file.read_text(encoding="utf-8"))
        text = compact(summary(found) | {"others": [summary(other) for other in found["others"]]})
        (TARGET / file.name).write_text(text + "\n", encoding="utf-8")


def summary(found: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of one protocol: all of posefield, the mean errors of its peers."""
    methods = {
        name: _part(method, (*METHOD, *MOVEMENT) if name.startswith("posefield") else METHOD)
        for name, method in found["methods"].items()
    }
    information = {
        name: _part(table, ("takes", "best")) | {"peers": _peers(table["peers"])}
        for name, table in found.get("equal_information", {}).items()
    }
    return _part(found, PROTOCOL) | {"methods": methods, "equal_information": information}


def _peers(peers: dict[str, Any]) -> dict[str, Any]:
    return {
        name: {measure: _part(row, PEER) for measure, row in _part(rows, POOLED).items()}
        for name, rows in peers.items()
    }


def _part(found: dict[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    return {key: found[key] for key in keys if key in found}


if __name__ == "__main__":
    main(Path(sys.argv[1]))
