"""Table of the returns from kicks: from the kick until a short time after the foot has landed.

python benchmarks/recipe_data/kick_returns.py DATA
"""

import csv
import sys
from pathlib import Path

import numpy as np

from posefield_train.source import clip_table, data_folder, ingest, recipe

LOW = 0.03
"""Height above the foot's lowest place after the kick, below which it has landed, m."""
STANDING = 0.2
"""Time after the landing that belongs to a return, s; later some performers walk off."""


def main(data: Path) -> None:
    """Write the table beside that of the kicks."""
    kicks = recipe.read(data_folder.RECIPES / "hdm05_kick.toml")
    rows = clip_table.read(kicks, data)
    files = ingest.read_files(rows, kicks.source)
    table = data_folder.RECIPES / "hdm05_kick/returns.csv"
    with table.open("w", encoding="utf-8", newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["file", "performer", "kick_frame", "return_frame"])
        for row in rows:
            clip = ingest.clip_of_file(files[str(row.file)], kicks.source)
            kick = row.last_frame or 0
            heights = clip.positions()[kick:, clip.skeleton.names.index("ltoes"), 1]
            landing = kick + int(np.argmax(heights < heights.min() + LOW))
            last = min(landing + round(STANDING * clip.rate), len(clip) - 1)
            writer.writerow([f"bvh/{row.file.name}", row.performer, kick, last])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
