"""The examples in C and Rust print the poses that the service gives: `run.py`, or this file.

Building tract takes minutes of processor time, so that CI compares its wheel instead (`engines`),
and `run.py --others` the example. C needs a compiler, and Go, whose registry has the header.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import environment
import numpy as np
import onnxruntime

import posefield
from posefield.motion import skeleton

EXAMPLES = environment.ROOT / "examples"
BUILD = environment.ROOT / "build"
HEADER = "github.com/yalue/onnxruntime_go@v1.27.0"
HEADER_SUM = "h1:c1YSgDNtpf0WGtxj3YeRIb8VC5LmM1J+Ve3uHdteC1U="
POSES = {
    "cmu_walk": (0.4, {"speed": 1.3, "turn": 0.0, "stride_length": 1.4}),
    "hdm05_squat": (0.7, {"hips_height": 0.4, "stance": 0.2}),
}
CLOSE = 1e-5


def rust_faults() -> list[str]:
    """Return the faults of the Rust example, one per line; without cargo print a note."""
    if not (cargo := _tool("cargo", "Rust")):
        return []
    manifest = ("--manifest-path", EXAMPLES / "rust/Cargo.toml")
    target = BUILD / "rust"
    where = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    subprocess.run(
        [cargo, "build", "--release", "--locked", "--quiet", *manifest], check=True, env=where
    )
    return _faults(target / "release/posefield-pose")


def c_faults() -> list[str]:
    """Return the faults of the C example, one per line; without a tool print a note."""
    compiler, go = _tool("cc", "C"), _tool("go", "C")
    if not (compiler and go):
        return []
    words = [go, "mod", "download", "-json", HEADER]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    header = json.loads(done.stdout)
    if header["Sum"] != HEADER_SUM:
        return [f"{HEADER} is {header['Sum']}, expected {HEADER_SUM}"]
    folder = BUILD / "c"
    folder.mkdir(parents=True, exist_ok=True)
    # Programs look for the library by this name.
    library, program = folder / "libonnxruntime.so.1", folder / "posefield-pose"
    library.unlink(missing_ok=True)
    (wheel,) = (Path(onnxruntime.__file__).parent / "capi").glob("libonnxruntime.so.*")
    library.symlink_to(wheel)
    options = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-isystem", header["Dir"])
    link = (library, f"-Wl,-rpath,{folder}", "-o", program)
    subprocess.run([compiler, *options, EXAMPLES / "c/pose.c", *link], check=True)
    return _faults(program)


def _tool(name: str, language: str) -> str | None:
    if (tool := shutil.which(name)) is None:
        print(f"SKIPPED: the {language} example, because there is no {name}")
    return tool


def _faults(program: Path) -> list[str]:
    return [fault for name in POSES if (fault := _fault(program, name))]


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
        return f"{name}: {program} printed {done.stdout[:200]!r} {done.stderr[:200]!r}"
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
    return "" if off < CLOSE < control else f"{name}: {program} is off by {off:g} m"


if __name__ == "__main__":
    print("\n".join(c_faults() + rust_faults()) or "no fault in the examples")
