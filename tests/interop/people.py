"""Motion capture of a person, carried onto the G1 of mjlab by the example and mink.

    .venv/bin/python tests/interop/people.py

mink needs qpsolvers, which is LGPL: both are installed apart, and neither is in the lock file.
"""

import json
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import environment
from trained import DATA

VENV = environment.ROOT / ".venv-mink"
PACKAGES = ("--no-deps", "mink==1.3.0", "qpsolvers==4.13.0", "daqp==0.11.0", "mjlab==1.6.0")
CAPTURE = "cmu_walk/bvh/p16_walking_33_tr.bvh"
MOST = {"sunk_mm": 1.0, "beyond_limits_degrees": 0.0, "fastest_rad_s": 20.01}
MOST_OFF = {"Foot": 3.0, "hips": 20.0, "Arm": 20.0, "Hand": 40.0}
"""Root mean square distances from the targets, mm."""
EXCHANGED = [f"{a}Foot={b}_ankle_roll_link" for a, b in (("left", "right"), ("right", "left"))]


def faults() -> list[str]:
    """Faults of the robot's motion; the control has its feet exchanged."""
    if not DATA.exists():
        print(f"no motion capture in {DATA}: set POSEFIELD_DATA")
        return []
    python = environment.packages(VENV, PACKAGES)
    packages = next(python.parents[1].glob("lib/*/site-packages"))
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(DATA / "cmu_walk.zip") as packed:
            capture = packed.extract(CAPTURE, folder)
        found = _wrong(_carried(packages, capture, folder))
        roles = [word for role in EXCHANGED for word in ("--role", role)]
        if not _wrong(_carried(packages, capture, folder, *roles)):
            found.append("people: exchanged feet are not found")
    return found


def _carried(packages: Path, capture: str, folder: str, *words: str) -> dict:
    robot = packages / "mjlab/asset_zoo/robots/unitree_g1/xmls/g1.xml"
    script = environment.ROOT / "examples/people_on_robot.py"
    command = [sys.executable, script, robot, capture, "--unit", "0.0564444", "-o", folder, *words]
    told = os.environ | {"PYTHONPATH": str(packages), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, env=told, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{script.name} failed:\n{done.stderr[-2000:]}")
    print(done.stdout.strip())
    return json.loads(done.stdout)


def _wrong(facts: dict) -> list[str]:
    figures = {name: (facts[name], most) for name, most in MOST.items()}
    for role, value in facts["off_mm"].items():
        figures[role] = value, next(most for end, most in MOST_OFF.items() if role.endswith(end))
    return [
        f"people: {name} is {value:.3g}, expected at most {most:g}"
        for name, (value, most) in figures.items()
        if value > most
    ]


if __name__ == "__main__":
    sys.exit("\n".join(faults()) or None)
