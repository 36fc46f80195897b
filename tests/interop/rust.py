"""The Rust example prints the poses that the service gives: `run.py --others`, or this file.

Building tract takes minutes of processor time, so that CI compares its wheel instead (`engines`).
"""

import os
import shutil
import subprocess
from pathlib import Path

import environment
import numpy as np

import posefield
from posefield.motion import skeleton

EXAMPLE = environment.ROOT / "examples/rust"
TARGET = environment.ROOT / "build/rust"
POSES = {
    "cmu_walk": (0.4, {"speed": 1.3, "turn": 0.0, "stride_length": 1.4}),
    "hdm05_squat": (0.7, {"hips_height": 0.4, "stance": 0.2}),
}
CLOSE = 1e-5


def faults() -> list[str]:
    """Return the faults of the example, one per line; without cargo print a note."""
    cargo = shutil.which("cargo")
    if cargo is None:
        print("SKIPPED: the Rust example, because there is no cargo")
        return []
    manifest = ("--manifest-path", EXAMPLE / "Cargo.toml")
    where = {**os.environ, "CARGO_TARGET_DIR": str(TARGET)}
    subprocess.run(
        [cargo, "build", "--release", "--locked", "--quiet", *manifest], check=True, env=where
    )
    return [fault for name in POSES if (fault := _fault(TARGET / "release/posefield-pose", name))]


def _fault(program: Path, name: str) -> str:
    time, controls = POSES[name]
    model = posefield.load(name)
    answer = model.pose(time, exact="none", **controls)
    joints = model.synthesizer.session.card.skeleton
    bones = skeleton.translations(
        answer.bone_offsets.astype(np.float64), answer.root_position.astype(np.float64)
    )
    (expected,) = skeleton.positions(joints.parents, answer.rotations.astype(np.float64), bones)
    path = environment.ROOT / f"service/posefield/shipped/{name}.onnx"
    words = [f"{control}={value}" for control, value in controls.items()]
    done = subprocess.run([program, path, str(time), *words], capture_output=True, text=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    if [line[0] for line in lines] != list(joints.names):
        return f"{name}: the Rust example printed {done.stdout[:200]!r} {done.stderr[:200]!r}"
    off = float(np.abs(np.array([line[1:] for line in lines], float) - expected).max())
    # A pose a hundredth of a second later is elsewhere.
    (later,) = skeleton.positions(
        joints.parents,
        (shifted := model.pose(time + 0.01, exact="none", **controls)).rotations.astype(float),
        skeleton.translations(
            shifted.bone_offsets.astype(float), shifted.root_position.astype(float)
        ),
    )
    control = float(np.abs(later - expected).max())
    print(f"{name:<20}{off:>10.1e}{control:>16.1e}")
    return "" if off < CLOSE < control else f"{name}: the Rust example is off by {off:g} m"


if __name__ == "__main__":
    print("\n".join(faults()) or "no fault in the Rust example")
