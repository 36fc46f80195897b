"""Constants of the run time in TypeScript, from the modules of the service that define them."""

from typing import Any

from posefield.constraints import constraint_solver
from posefield.feet import ball_path, body_plans, limbs, smooth_change, stance_rows
from posefield.locomotion import stride
from posefield.motion import contact_detection, hinges
from posefield.synthesis import clip_draft, standing_feet

# Names of TypeScript, and the module and the name of each in Python.
CONSTANTS: dict[str, tuple[Any, str]] = {
    "FPS_RANGE": (clip_draft, "FPS_RANGE"),
    "AFTER_END": (stride, "AFTER_END"),
    "WARP_STEPS": (constraint_solver, "WARP_STEPS"),
    "FRAME_ROUNDING": (clip_draft, "ROUNDING"),
    "PLAN_RATE": (standing_feet, "RATE"),
    "FEWEST_STEPS": (standing_feet, "FEWEST"),
    "MOST_STEPS": (standing_feet, "MOST"),
    "SHORTEST_CONTACT": (stance_rows, "SHORTEST_CONTACT"),
    "SHORTEST_GAP": (stance_rows, "SHORTEST_GAP"),
    "SHORTEST_STEP": (stance_rows, "SHORTEST_STEP"),
    "LIFTED": (stance_rows, "LIFTED"),
    "UNEVEN": (stance_rows, "UNEVEN"),
    "SUNK": (stance_rows, "SUNK"),
    "STANDING": (stance_rows, "STANDING"),
    "PROBABILITY_DECIMALS": (stance_rows, "DECIMALS"),
    "REACH_ROUNDS": (body_plans, "ROUNDS"),
    "STILL_SPEED": (contact_detection.DEFAULT, "grown_speed"),
    "FLAT_PERCENTILE": (ball_path, "FLAT"),
    "HEEL": (ball_path, "HEEL"),
    "MOST_HEEL_LIFT": (ball_path, "MOST_LIFT"),
    "PATH_SPREAD": (smooth_change, "SPREAD"),
    "LIFT_SHARE": (ball_path, "LIFT_SHARE"),
    "FULL_STEP": (ball_path, "FULL_STEP"),
    "RISE": (ball_path, "RISE"),
    "LIFT_EXPONENT": (ball_path, "LIFT_EXPONENT"),
    "LEAST_LIFT": (ball_path, "LEAST_LIFT"),
    "LIFT_ACCELERATION": (ball_path, "LIFT_ACCELERATION"),
    "REACH": (limbs, "REACH"),
    "SOFTNESS": (limbs, "SOFTNESS"),
    "STRAIGHT": (limbs, "STRAIGHT"),
    "PRESS": (limbs, "PRESS"),
    "PELVIS_SPREAD": (body_plans, "SPREAD"),
    "PELVIS_SMOOTHING": (body_plans, "SMOOTHING"),
    "MOST_LOWERED": (body_plans, "MOST"),
    "HINGE_FREE": (hinges, "FREE"),
    "HINGE_MOST": (hinges, "MOST"),
}


def constants() -> str:
    """Return the module of constants in TypeScript."""
    lines = ["// Generated from the service by docs/generate.py.", ""]
    for name, (module, python_name) in CONSTANTS.items():
        value = getattr(module, python_name)
        numbers = ", ".join(map(number, value)) if isinstance(value, tuple) else number(value)
        literal = f"[{numbers}] as const" if isinstance(value, tuple) else numbers
        lines.append(f"export const {name} = {literal};")
    return "\n".join(lines) + "\n"


def number(value: float) -> str:
    """Return a number as Biome writes it in TypeScript."""
    text = repr(float(value))
    return text.removesuffix(".0").replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")
