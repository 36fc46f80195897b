"""Draws the guide's pictures of simulators' people: strips of a street corner and of a corridor.

.venv/bin/python docs/draw_simulators.py
"""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import posefield
from posefield.encode import bone_motion, character
from posefield.encode.skinned_mesh import FULL_WEIGHT, triangles, vertex_normals
from posefield.motion import quat
from posefield.question.walk_question import WalkQuestion
from posefield.tracks import track_crowd, track_files

DOCS = Path(__file__).parent
DATA = DOCS.parent / "tests/data"
SUN = np.array([0.35, 0.85, -0.4])
GROUND, SKY = (222, 227, 235), (238, 241, 246)
COLOURS = np.array([[122, 156, 214], [214, 150, 110], [130, 180, 140], [190, 140, 190]], float)


class Street:
    """People of a simulator, and a camera at `eye` that looks at `middle` (X, Y, Z, m)."""

    def __init__(self, tracks, eye, middle, lens):
        walker = posefield.load("cmu_walk").synthesizer
        people = track_files.read_tracks(DATA / tracks, skip_bad=True).tracks
        order = WalkQuestion(count=len(people), seconds=1.0, fps=15.0, take="index")
        crowd = track_crowd.build_crowd(walker, walker.gait, order, people)
        self.motions = list(bone_motion.character_motions(crowd))
        self.begin, self.rate, self.lens = crowd.facts["begin"], crowd.rate, lens
        self.rig = character.rig(crowd.skeleton)
        self.faces = triangles(self.rig.body.counts, self.rig.body.corners)
        self.eye = np.array(eye, float)
        ahead = np.array(middle, float) - self.eye
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        self.axes = np.stack([right, np.cross(right, ahead), ahead])

    def picture(self, time, width, height):
        """Return the picture at a time of the tracks, s."""
        large = Image.new("RGB", (2 * width, 2 * height), GROUND)
        pen = ImageDraw.Draw(large)
        bodies = [self.skin(motion, time) for motion in self.motions if self.there(motion, time)]
        for points, _ in bodies:
            middle = points.mean(axis=0) * [1.0, 0.0, 1.0]
            angles = np.linspace(0.0, 2.0 * np.pi, 17)
            ring = middle + 0.28 * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
            pen.polygon(self.flat(ring, width, height), fill=(200, 206, 216))
        for points, colour in sorted(bodies, key=lambda body: -self.seen(body[0])[:, 2].mean()):
            flat = np.array(self.flat(points, width, height))[self.faces]
            normals = vertex_normals(points, self.faces)[self.faces].mean(axis=1)
            toward = np.einsum("tk,tk->t", normals, self.eye - points[self.faces].mean(axis=1))
            depth = self.seen(points)[:, 2][self.faces].mean(axis=1)
            light = 0.45 + 0.55 * np.clip(normals @ SUN, 0.0, 1.0)
            for at in np.argsort(-depth):
                if toward[at] > 0.0:
                    shade = tuple(np.minimum(255, light[at] * colour).astype(int).tolist())
                    pen.polygon([tuple(corner) for corner in flat[at]], fill=shade)
        return large.resize((width, height), Image.Resampling.LANCZOS)

    def there(self, motion, time):
        """Return whether a person is there and before the camera."""
        frame = round((time - self.begin) * self.rate) - motion.first
        if not 0 <= frame < len(motion):
            return False
        return self.seen(motion.roots[frame][None])[0, 2] > 2.0

    def skin(self, motion, time):
        """Return the points (P, 3) of a person in the world, m, and its colour."""
        frame = round((time - self.begin) * self.rate) - motion.first
        joints, turns = (values[0] for values in motion.world(slice(frame, frame + 1)))
        local = np.concatenate([motion.roots[:1], motion.offsets[1:]])[None]
        rest = character.rest_pose(self.rig, local)
        points, bind = rest.points[0], motion.skeleton.at_rest(rest.offsets[0])
        skin = np.zeros_like(points)
        for of, weights in zip(self.rig.body.joints.T, self.rig.body.weights.T, strict=True):
            posed = joints[of] + quat.rotate(turns[of], points - bind[of])
            skin += (weights / FULL_WEIGHT)[:, None] * posed
        return skin, COLOURS[motion.index % len(COLOURS)]

    def seen(self, points):
        """Return points (P, 3) to the right, up and ahead of the camera, m."""
        return (points - self.eye) @ self.axes.T

    def flat(self, points, width, height):
        """Return pixels (P, 2) of points on a picture of twice the size."""
        x, y, z = np.moveaxis(self.seen(points), -1, 0)
        scale = 2.0 * self.lens * width / np.maximum(z, 0.1)
        return list(zip(width + scale * x, height - scale * y, strict=True))


def strip(street, times, width, height, path):
    """Write pictures at some times below one another."""
    sheet = Image.new("RGB", (width, len(times) * (height + 4) - 4), SKY)
    for row, time in enumerate(times):
        sheet.paste(street.picture(time, width, height), (0, row * (height + 4)))
    sheet.quantize(64).save(path, optimize=True)


if __name__ == "__main__":
    corridor = Street("jupedsim_corridor.sqlite", (12, 5.5, 8), (12, 0.6, -2.2), 0.62)
    strip(corridor, (1.0, 5.0, 9.0), 900, 260, DOCS / "simulators-corridor.png")
    corner = Street("sumo_corner.xml", (75, 6, -40), (55, 0.8, -58), 0.75)
    strip(corner, (12.0, 20.0, 28.0), 900, 300, DOCS / "simulators-corner.png")
    frames = [corner.picture(16.0 + step / 7.5, 480, 200).quantize(32) for step in range(45)]
    frames[0].save(
        DOCS / "simulators.gif", save_all=True, append_images=frames[1:], duration=133, loop=0
    )
