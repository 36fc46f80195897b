"""Write a biped robot of boxes and capsules, and its gaits at many commands, to be trained.

    python examples/biped_gaits.py biped
    posefield doctor biped/gaits/*.json --robot biped/biped.xml
    posefield train biped/recipe.toml -o biped.onnx

The folder has the robot's MJCF file, a gait of one cycle for each command, a table of the commands
and a recipe. Feet stand still on the floor and swing between their places; the legs' angles follow
in closed form. Nothing is random but the commands.
"""

import sys
from pathlib import Path

import numpy as np

from posefield.motion import quat
from posefield.robots.file_writers import write_awd
from posefield.robots.robot_motion import RobotMotion
from posefield_train.robots import robot_file

COMMANDS = {"forward": (-0.15, 0.45), "left": (-0.12, 0.12), "turning": (-0.8, 0.8)}
"""Least and largest commands: m/s, m/s and rad/s."""
COUNT, RATE, CYCLE = 60, 50.0, 0.8
"""Gaits, frames a second, and seconds of a cycle."""
THIGH, SHIN, ANKLE, HIP, HEIGHT, LIFT = 0.26, 0.26, 0.05, 0.085, 0.54, 0.05
"""Lengths of a leg's parts, height of the ankle, half the hips' distance, the base's height, and
the height of a step, m."""
STANCE = 0.6
"""Share of the cycle in which a foot stands."""

LEG = """<body name="{side}_hip" pos="0 {y} 0">
<joint name="{side}_hip_yaw" axis="0 0 1" range="-0.9 0.9"/>
<geom type="sphere" size="0.045" mass="0.3"/>
<body name="{side}_thigh"><joint name="{side}_hip_roll" axis="1 0 0" range="-0.6 0.6"/>
<joint name="{side}_hip_pitch" axis="0 1 0" range="-1.6 1.2"/>
<geom type="capsule" fromto="0 0 0 0 0 -{thigh}" size="0.035" mass="0.8"/>
<body name="{side}_shin" pos="0 0 -{thigh}"><joint name="{side}_knee" axis="0 1 0" range="0 2.2"/>
<geom type="capsule" fromto="0 0 0 0 0 -{shin}" size="0.028" mass="0.5"/>
<body name="{side}_foot" pos="0 0 -{shin}">
<joint name="{side}_ankle_pitch" axis="0 1 0" range="-1.2 1.2"/>
<joint name="{side}_ankle_roll" axis="1 0 0" range="-0.6 0.6"/>
<geom type="box" size="0.09 0.04 0.015" pos="0.025 0 -0.035" mass="0.3"/>
</body></body></body></body>"""
ROBOT = """<mujoco model="biped"><compiler angle="radian" autolimits="true"/>
<default><geom friction="0.9"/></default>
<worldbody><geom name="floor" type="plane" size="9 9 0.1"/>
<body name="base" pos="0 0 {height}"><freejoint/>
<geom type="box" size="0.06 0.11 0.05" pos="0 0 0.04" mass="2"/>
<geom type="box" size="0.07 0.12 0.11" pos="0 0 0.21" mass="4"/>
<geom type="sphere" size="0.075" pos="0.01 0 0.42" mass="1"/>
{legs}</body></worldbody>
<actuator>{motors}</actuator></mujoco>
"""
HINGES = [
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")
]
RECIPE = """schema = 1
name = "biped"
description = "Gaits of a biped robot by command"
licence = "CC0-1.0"

[robot]
model = "biped.xml"

[clips]
table = "clips.csv"
file = "file"

[motion]
frames = 41
cyclic = true
root = "travelling"

[alignment]
warp = "identity"

[size]
rms_budget_cm = 0.005
"""
CONTROL = """
[[controls]]
name = "{name}"
column = "{name}"
unit = "{unit}"
description = "Command: {name}"
"""


def base_at(command: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return places (F, 2), m, and headings (F,), rad, of a base at a constant command."""
    headings = command[2] * times
    # The exact integral of a constant velocity in a frame that turns.
    half = 0.5 * headings
    way = np.sinc(half / np.pi)[:, None] * times[:, None] * command[:2]
    return turned(way, half), headings


def turned(vectors: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return vectors (F, 2) turned to the left."""
    cos, sin = np.cos(angles), np.sin(angles)
    x, y = vectors[:, 0], vectors[:, 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def foot_path(command: np.ndarray, times: np.ndarray, side: float, begin: float):
    """Return ankles (F, 3), m, and headings (F,), rad, of a foot; side: 1 for the left one.

    It stands where the base is above it in the middle of its stance; begin: of that, in cycles.
    """
    phase = times / CYCLE - begin
    stand = np.floor(phase)
    share = np.clip((phase - stand - STANCE) / (1.0 - STANCE), 0.0, 1.0)

    def place(number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        path, heading = base_at(command, (number + begin + 0.5 * STANCE) * CYCLE)
        return path + turned(np.tile([0.0, side * (HIP + 0.01)], (len(path), 1)), heading), heading

    (first, turn), (second, next_turn) = place(stand), place(stand + 1.0)
    blend = share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi)
    path = first + blend[:, None] * (second - first)
    height = ANKLE + LIFT * np.sin(np.pi * share) ** 2
    return np.column_stack([path, height]), turn + blend * (next_turn - turn)


def leg_angles(ankle: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Return the six angles (F, 6) of a leg with a level foot; ankle (F, 3): from the hip, m."""
    path = np.column_stack([turned(ankle[:, :2], -yaw), ankle[:, 2]])
    roll = np.arctan2(path[:, 1], -path[:, 2])
    down = np.hypot(path[:, 1], path[:, 2])
    length = np.hypot(path[:, 0], down)
    cosine = (THIGH**2 + SHIN**2 - length**2) / (2.0 * THIGH * SHIN)
    knee = np.pi - np.arccos(np.clip(cosine, -1.0, 1.0))
    bend = np.arctan2(SHIN * np.sin(knee), THIGH + SHIN * np.cos(knee))
    hip = np.arctan2(-path[:, 0], down) - bend
    return np.stack([yaw, roll, hip, knee, -hip - knee, -roll], axis=-1)


def gait(command: np.ndarray) -> RobotMotion:
    """Return a cycle at a command (3,), the last frame of which is the first of the next."""
    times = np.arange(round(CYCLE * RATE) + 1) / RATE
    path, heading = base_at(command, times)
    sway = np.column_stack(
        [np.zeros_like(times), -0.02 * np.cos(2.0 * np.pi * (times / CYCLE - 0.55))]
    )
    path = path + turned(sway, heading)
    height = HEIGHT + 0.008 * np.cos(4.0 * np.pi * times / CYCLE)
    base = np.column_stack([path, height])
    angles = []
    for side, begin in ((1.0, 0.0), (-1.0, 0.5)):
        ankle, foot_heading = foot_path(command, times, side, begin)
        hip = base + np.column_stack(
            [turned(np.tile([0.0, side * HIP], (len(path), 1)), heading), 0.0 * times]
        )
        away = ankle - hip
        local = np.column_stack([turned(away[:, :2], -heading), away[:, 2]])
        angles.append(leg_angles(local, foot_heading - heading))
    rotations = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), heading)
    return RobotMotion(
        "", "awd.json", base, rotations, np.hstack(angles), RATE, tuple(HINGES), loops=True
    )


def main(folder: Path) -> None:
    """Write the folder."""
    (folder / "gaits").mkdir(parents=True)
    legs = "".join(
        LEG.format(side=side, y=y, thigh=THIGH, shin=SHIN)
        for side, y in (("left", HIP), ("right", -HIP))
    )
    motors = "".join(f'<motor joint="{hinge}" ctrlrange="-60 60"/>' for hinge in HINGES)
    (folder / "biped.xml").write_text(ROBOT.format(height=HEIGHT, legs=legs, motors=motors))
    robot = robot_file.read(folder / "biped.xml")
    low, high = np.array(list(COMMANDS.values())).T
    rows = [",".join(["file", *COMMANDS])]
    for number, share in enumerate(np.random.default_rng(0).random((COUNT, len(low)))):
        command = (low + share * (high - low)).round(3)
        (folder / f"gaits/{number:02}.json").write_bytes(write_awd(gait(command), robot))
        rows.append(",".join([f"gaits/{number:02}.json", *map(str, command.tolist())]))
    (folder / "clips.csv").write_text("\n".join(rows) + "\n")
    units = ("m/s", "m/s", "rad/s")
    controls = [
        CONTROL.format(name=name, unit=unit) for name, unit in zip(COMMANDS, units, strict=True)
    ]
    (folder / "recipe.toml").write_text(RECIPE + "".join(controls))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
