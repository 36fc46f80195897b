"""Write docs/results/models.json: size, errors and levels of detail of model files, by their cards.

python docs/measure_models.py service/posefield/shipped/*.onnx hdm05_grab_high.onnx ...

The names of the models are those of their recipes. Files of recipes that are not shipped are made
by `posefield train`. Run docs/generate.py afterwards.
"""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from posefield.inference import session

TARGET = Path(__file__).parent / "results/models.json"
MACHINE = "any: the figures are those of the models' cards"
LEVEL_KEYS = ("ranks", "samples", "numbers", "operations", "rms", "pose")


def main(files: list[Path]) -> None:
    """Write the figures of model files."""
    found = {
        "command": "python docs/measure_models.py",
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "machine": MACHINE,
        "models": [figures(file) for file in files],
    }
    TARGET.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def figures(file: Path) -> dict[str, Any]:
    """Return the figures of a model file."""
    opened = session.load(file)
    card = opened.card
    diagnostics = card.diagnostics
    return {
        "name": card.name,
        "digest": opened.digest,
        "clips": card.samples,
        "bytes": file.stat().st_size,
        "compression": diagnostics["compression"]["stored"],
        **{
            name: diagnostics[name]
            for name in ("truncation_rms_m", "truncation_p99_m", "leave_one_out_rms_m")
        },
        "levels": [{key: getattr(level, key) for key in LEVEL_KEYS} for level in card.levels],
    }


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
