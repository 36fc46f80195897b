"""Time of a step of reference motions in a training loop, by torch on a device.

    python benchmarks/training_loop.py model.onnx --device cuda

Prints JSON: milliseconds of a step of unchanged commands, of a step in which eight change, and of
the first plan of all; on a processor those of CPU time. Needs torch; takes half a minute.
"""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from posefield.inference import session
from posefield.reference.torch import ReferenceMotion

STEPS, CHANGED = 50, 8


def main() -> None:
    """Print the figures of a model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", help=".onnx file of a robot's gaits")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--environments", type=int, default=4096)
    options = parser.parse_args()
    torch.set_num_threads(1)
    device, count = torch.device(options.device), options.environments
    reference = ReferenceMotion(options.model, device=device)
    captured = torch.tensor(
        session.load(Path(options.model)).card.examples, dtype=torch.float32, device=device
    )
    commands = captured[torch.randint(len(captured), (count,), device=device)]
    phase = torch.rand(count, device=device)

    def step(number: int, changed: int = 0) -> None:
        commands[:changed] = captured[torch.randint(len(captured), (changed,), device=device)]
        reference.sample(commands, phase + 0.01 * number)

    clock = time.process_time if device.type == "cpu" else time.perf_counter

    def milliseconds(action: Callable[[], None]) -> float:
        synchronize(device)
        begin = clock()
        action()
        synchronize(device)
        return 1e3 * (clock() - begin)

    first = milliseconds(lambda: step(0))
    steps = [milliseconds(lambda number=number: step(number)) for number in range(STEPS)]
    changing = [
        milliseconds(lambda number=number: step(number, CHANGED)) for number in range(STEPS)
    ]
    figures = {
        "device": torch.cuda.get_device_name(device) if device.type == "cuda" else "one CPU core",
        "environments": count,
        "first_plan_ms": round(first, 1),
        "step_ms": round(float(np.median(steps)), 3),
        "step_with_8_changed_ms": round(float(np.median(changing)), 3),
    }
    print(json.dumps(figures, indent=2))


def synchronize(device: torch.device) -> None:
    """Wait for the device."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)


if __name__ == "__main__":
    main()
