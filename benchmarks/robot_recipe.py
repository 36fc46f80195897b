"""Write the table and the recipe of a folder of gaits of `rimim/AWD`'s biped beside its files.

    python benchmarks/robot_recipe.py build/data/robot_go_bdx

One cycle of each gait is cut behind the robot's start; its commands are those of the planner.
"""

import json
import sys
from pathlib import Path

COMMANDS = {"forward": "dx", "left": "dy", "turning": "dtheta"}
"""Columns of the commands."""
FIRST, PERIOD, RATE = 240, 99, 60.0
"""First frame of the cycle, behind the robot's start, its frames, and frames a second."""
RECIPE = """schema = 1
name = "go_bdx"
description = "Gaits of a biped"
licence = "NVIDIA, not commercial"
[robot]
model = "go_bdx.xml"
[clips]
table = "clips.csv"
file = "file"
first_frame = "first"
last_frame = "last"
[motion]
frames = 100
cyclic = true
root = "travelling"
[alignment]
warp = "identity"
[size]
rms_budget_cm = 0.005
"""


def write(folder: Path) -> Path:
    """Write clips.csv and recipe.toml into a folder of gaits, and return the recipe's path."""
    rows = ["file,dx,dy,dtheta,first,last"]
    for path in sorted((folder / "gaits").glob("*.json"), key=lambda path: int(path.stem)):
        stated = json.loads(path.read_text())["Placo"]
        command = ",".join(str(stated[column]) for column in COMMANDS.values())
        rows.append(f"gaits/{path.name},{command},{FIRST},{FIRST + PERIOD}")
    (folder / "clips.csv").write_text("\n".join(rows) + "\n")
    controls = [
        f'[[controls]]\nname = "{name}"\ncolumn = "{column}"\nunit = "{unit}"\n'
        'description = "Command"'
        for (name, column), unit in zip(COMMANDS.items(), ("m/s", "m/s", "rad/s"), strict=True)
    ]
    path = folder / "recipe.toml"
    path.write_text("\n".join([RECIPE, *controls]))
    return path


if __name__ == "__main__":
    write(Path(sys.argv[1]))
