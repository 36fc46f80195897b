"""A baked walk blended by three.js, by the program of the guide, beside the model's own clips."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import environment

import posefield

HERE = Path(__file__).parent
GUIDE = environment.ROOT / "docs/guide/blend-spaces.md"
POINTS = {"between": [0.7375, 17.0], "captured": [1.15, 2.0], "faster": [1.6, -1.0]}
CONTROL = "elsewhere"
"""Name of a clip of the model at other controls than those of the blend."""


def faults(node: Path) -> list[str]:
    """Return the faults of blending, a line each; print the distances."""
    program = GUIDE.read_text().partition("```js\n")[2].partition("```\n")[0]
    modules = environment.THREE / "node_modules"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        words = ("bake", "cmu_walk", "--grid", "speed=0.6:1.7:5", "--grid", "turn=-4:20:5")
        command = Path(sys.executable).with_name("posefield")
        subprocess.run([command, *words, "-o", folder], check=True, capture_output=True)
        (folder / "walker.mjs").write_text(program)
        (folder / "node_modules").symlink_to(modules)
        space = json.loads((folder / "blendspace.json").read_text())
        points = {**POINTS, CONTROL: POINTS["between"]}
        (folder / "points.json").write_text(json.dumps(points))
        for clip, (speed, turn) in {**POINTS, CONTROL: POINTS["faster"]}.items():
            controls = {"speed": speed, "turn": turn, "stride_length": _stride(space, speed, turn)}
            answer = posefield.load("cmu_walk").clip(**controls, loop=True, root="bone")
            answer.save(folder / f"{clip}.glb")
        result = folder / "result.json"
        subprocess.run([node, HERE / "blend_read.mjs", modules, folder, result], check=True)
        return [*_compared(space["error"], json.loads(result.read_text()))]


def _stride(space: Mapping, speed: float, turn: float) -> float:
    """Return the stride length between the corners of the grid."""
    corners = [space["samples"][i]["controls"]["stride_length"] for i in (0, 4, 20, 24)]
    fast, left = (speed - 0.6) / 1.1, (turn + 4.0) / 24.0
    slow, quick = (a + left * (b - a) for a, b in (corners[:2], corners[2:]))
    return slow + fast * (quick - slow)


def _compared(error: Mapping[str, float], found: Mapping[str, Mapping]) -> Iterator[str]:
    print(f"{'blend':<12}{'off, cm':>10}{'m/s':>8}{'fastest':>9}")
    for name, row in found.items():
        off, speed, fastest = 100.0 * row["distance"], row["speed"], row["fastest"]
        print(f"{name:<12}{off:>10.2f}{speed:>8.3f}{fastest:>9.3f}")
        if name == CONTROL:
            if off < 5.0:
                yield f"blend of {name}: only {off:g} cm from another walk"
            continue
        asked = POINTS[name][0]
        # Hips sway, and go faster as a foot comes down. At a jump they would be far beyond it.
        if off > error["worst_cm"] + 0.1 or abs(speed - asked) > 0.06 or fastest > 1.5 * asked:
            yield f"blend of {name}: {off:g} cm off, {speed:g} m/s, at most {fastest:g}"


if __name__ == "__main__":
    print("\n".join(faults(environment.prepare()[1])) or "no fault in blends")
