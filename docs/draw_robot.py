"""Draws the guide's picture of a robot that walks at nine commands, and where its feet stand.

python examples/biped_gaits.py build/biped
posefield train build/biped/recipe.toml -o build/biped.onnx
.venv/bin/python docs/draw_robot.py build/biped.onnx build/biped/biped.xml docs/robot.png
"""

import sys

import mujoco
import numpy as np
from PIL import Image, ImageDraw

import posefield
from posefield.motion import quat
from posefield.robots.robot_motion import RobotMotion

CYCLES, RATE, POSES, SETTLED = 3, 50.0, 4, 8
"""Cycles, frames a second, drawn poses, and frames from a foot's touch down until it rests."""
ROWS = ((0.4, 0.0), (0.15, 0.0), (0.0, 0.1))
TURNS = (0.6, 0.0, -0.6)
"""Commands: ahead and to the left of each row, m/s, and the turn of each column, rad/s."""
WIDE, HIGH, SCALE, LARGE = 400, 290, 190.0, 3
AROUND, ABOVE = np.radians(-58.0), np.radians(26.0)
"""Directions from which the camera looks."""
SUN = np.array([0.2, -0.55, 0.81])
BACKGROUND, INK, FLOOR = (238, 241, 246), (60, 66, 80), (190, 197, 210)
BODY, LEFT, RIGHT = np.array([150, 158, 172]), np.array([70, 120, 210]), np.array([225, 120, 50])


def walk(model: posefield.Model, command: dict[str, float]) -> RobotMotion:
    """Return some cycles, one behind the other."""
    one = model.clip(**command, fps=RATE, loop=True).robot_motion()
    path, rotations = [one.base_path[:-1]], [one.base_rotations[:-1]]
    step = quat.mul(one.base_rotations[-1], quat.conj(one.base_rotations[0]))
    for _ in range(CYCLES - 1):
        # The last frame of a cycle is the first of the next.
        start = one.base_path[0] * [1, 1, 0]
        end = one.base_path[-1] * [1, 1, 0]
        path.append(quat.rotate(step, path[-1] - start) + end)
        rotations.append(quat.mul(step, rotations[-1]))
    angles = np.tile(one.angles[:-1], (CYCLES, 1))
    return RobotMotion(
        "", "clip", np.concatenate(path), np.concatenate(rotations), angles, RATE, one.hinges
    )


def seen(points: np.ndarray) -> np.ndarray:
    """Return places to the right and up in the picture, and depths, of points (..., 3), m."""
    cos, sin = np.cos(AROUND), np.sin(AROUND)
    right = -sin * points[..., 0] + cos * points[..., 1]
    near = cos * points[..., 0] + sin * points[..., 1]
    up = np.cos(ABOVE) * points[..., 2] - np.sin(ABOVE) * near
    return np.stack([right, up, np.cos(ABOVE) * near + np.sin(ABOVE) * points[..., 2]], axis=-1)


class Panel:
    """Picture of one command, drawn larger and smoothed."""

    def __init__(self, middle: np.ndarray) -> None:
        self.image = Image.new("RGB", (LARGE * WIDE, LARGE * HIGH), BACKGROUND)
        self.pen, self.middle = ImageDraw.Draw(self.image), seen(middle)

    def flat(self, points: np.ndarray) -> list[tuple[float, float]]:
        """Return places of points (N, 3) in the picture."""
        places = (seen(points) - self.middle) * SCALE
        at = np.stack([WIDE / 2 + places[:, 0], 0.76 * HIGH - places[:, 1]], axis=-1)
        return [tuple(place) for place in (LARGE * at).tolist()]

    def shape(self, model: mujoco.MjModel, state: mujoco.MjData, geom: int, share: float) -> None:
        """Draw one shape of the robot; share: of its colour, beside the background's."""
        place, turn = state.geom_xpos[geom], state.geom_xmat[geom].reshape(3, 3)
        size, kind = model.geom_size[geom], model.geom_type[geom]
        name = model.body(model.geom_bodyid[geom]).name
        paint = LEFT if name.startswith("left") else RIGHT if name.startswith("right") else BODY

        def colour(light: float) -> tuple[int, ...]:
            lit = np.clip(light * paint, 0, 255)
            return tuple((share * lit + (1 - share) * np.array(BACKGROUND)).astype(int).tolist())

        if kind == mujoco.mjtGeom.mjGEOM_BOX:
            for axis in range(3):
                for side in (-1.0, 1.0):
                    normal = side * turn[:, axis]
                    if seen(normal)[2] <= 0:
                        continue
                    others = [turn[:, other] * size[other] for other in range(3) if other != axis]
                    signs = ((-1, -1), (-1, 1), (1, 1), (1, -1))
                    corners = [
                        normal * size[axis] + a * others[0] + b * others[1] for a, b in signs
                    ]
                    self.pen.polygon(
                        self.flat(place + np.array(corners)), fill=colour(0.7 + 0.4 * normal @ SUN)
                    )
            return
        long = turn[:, 2] * (size[1] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0)
        radius = LARGE * SCALE * size[0]
        for width, light in ((1.0, 0.78), (0.75, 0.92), (0.45, 1.04)):
            ends = self.flat(
                np.array([place - long, place + long]) + 0.2 * (1 - width) * size[0] * SUN
            )
            self.pen.line(ends, fill=colour(light), width=max(1, round(2 * radius * width)))
            for x, y in ends:
                reach = radius * width
                self.pen.ellipse((x - reach, y - reach, x + reach, y + reach), fill=colour(light))

    def done(self, caption: str) -> Image.Image:
        """Return the picture with its caption."""
        small = self.image.resize((WIDE, HIGH), Image.Resampling.LANCZOS)
        ImageDraw.Draw(small).text((12, HIGH - 24), caption, fill=INK, font_size=14)
        return small


def panel(model: posefield.Model, robot: mujoco.MjModel, command: dict[str, float]) -> Image.Image:
    """Return the picture of one command."""
    motion = walk(model, command)
    state = mujoco.MjData(robot)
    drawing = Panel(0.5 * (motion.base_path[0] + motion.base_path[-1]) * [1, 1, 0])
    card = model.synthesizer.session.card
    for points in card.robot.foot_points(*motion.body_poses(card.robot)):
        low = points[..., 2].min(axis=1) < 0.01
        for frame in np.flatnonzero(low[:-SETTLED] & ~np.roll(low, 1)[:-SETTLED]) + SETTLED:
            corners = points[frame]
            corners = corners[corners[:, 2] < corners[:, 2].min() + 0.005]
            around = corners.mean(axis=0)
            order = np.argsort(np.arctan2(*(corners - around)[:, :2].T))
            drawing.pen.polygon(drawing.flat(corners[order] * [1, 1, 0]), fill=FLOOR)
    for pose in range(POSES):
        frame = round(pose * (len(motion) - 1) / (POSES - 1))
        state.qpos[:] = np.concatenate(
            [motion.base_path[frame], motion.base_rotations[frame], motion.angles[frame]]
        )
        mujoco.mj_kinematics(robot, state)
        shapes = [geom for geom in range(robot.ngeom) if robot.geom_bodyid[geom]]
        # Poses that would hide one another are left out.
        if 0 < pose < POSES - 1 and command["forward"] < 0.3:
            continue
        share = 0.3 + 0.7 * pose / (POSES - 1)
        for geom in sorted(shapes, key=lambda geom: seen(state.geom_xpos[geom])[2]):
            drawing.shape(robot, state, geom, share)
    return drawing.done(", ".join(f"{name} {value:g}" for name, value in command.items()))


def main(model: str, robot: str, picture: str) -> None:
    """Write the picture."""
    opened, body = posefield.load(model), mujoco.MjModel.from_xml_path(robot)
    sheet = Image.new("RGB", (3 * WIDE + 8, 3 * HIGH + 8), (255, 255, 255))
    for row, (forward, left) in enumerate(ROWS):
        for column, turning in enumerate(TURNS):
            command = {"forward": forward, "left": left, "turning": turning}
            sheet.paste(panel(opened, body, command), (column * (WIDE + 4), row * (HIGH + 4)))
    sheet.quantize(64).save(picture, optimize=True)


main(*sys.argv[1:4])
