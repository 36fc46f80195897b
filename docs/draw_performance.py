"""Draws the guide's picture of a performance: moments of it along its path, coloured by segment.

posefield perform SCRIPT.json -o MOTION.usdc
posefield perform SCRIPT.json -o MOTION.npz
.venv-blender/bin/python docs/draw_performance.py MOTION.usdc MOTION.npz SCRIPT.json LARGE.png
.venv/bin/python docs/draw_performance.py LARGE.png [LARGE.png ...] PICTURE.png

The scripts are the last ones of docs/guide/performances.md. A ball on a post shows its target. The
README shows the picture, too.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np

WALKING, ARRIVING = 0.9, 0.45
"""Distance along the path between two figures that walk, and least one to an act, m."""
HOP = 0.1
"""Rise of the root from which on an act is a hop, m."""
WIDE, HIGH = 1200, 440
FIGURES, SMALL = (150, 20, 1150, 340), (640, 205)
"""Part of a picture that has figures, and its size where several are one picture."""
BALL, POST = 0.07, 0.012
"""Radii of a target, m."""
SEGMENTS = (
    (0.03, 0.15, 0.5),
    (0.85, 0.2, 0.02),
    (0.85, 0.2, 0.02),
    (0.9, 0.5, 0.05),
    (0.04, 0.4, 0.2),
)
"""Colours of the segments, in their order."""
TARGET, FLOOR, SKY = (0.9, 0.02, 0.1), (0.3, 0.3, 0.33), (0.6, 0.68, 0.8)


def draw(clip: str, numbers: str, script: str, picture: str) -> None:
    """Import the performance as anyone would, and freeze some of its frames into one scene."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=clip)
    with np.load(numbers) as found:
        segments = json.loads(str(found["trust"]))["segments"]
        rate, roots = float(found["rate"]), z_up(found["root_position"])
    # The last segment is a walk in all pictures.
    colours = *SEGMENTS[: len(segments) - 1], SEGMENTS[-1]
    paints = [paint(bpy, colour) for colour in colours]
    own = np.array([segment_at(segments, frame / rate) for frame in range(len(roots))])
    body = next(thing for thing in bpy.data.objects if thing.type == "MESH")
    for frame in moments(segments, own, roots, rate):
        bpy.context.scene.frame_set(int(frame))
        freeze(bpy, body, paints[own[frame]])
    for index in range(len(segments)):
        lay_path(bpy, roots[own == index], paints[index])
    for each in json.loads(Path(script).read_text(encoding="utf-8"))["segments"]:
        for target in each.get("targets", ()):
            stand_target(bpy, z_up(target["position"]))
    for thing in list(bpy.data.objects):
        if not thing.name.startswith("frozen"):
            bpy.data.objects.remove(thing)
    light_and_look(bpy, bpy.context.scene, (roots.min(axis=0) + roots.max(axis=0)) / 2.0)
    bpy.context.scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)


def z_up(points) -> np.ndarray:
    """Return points (..., 3) of a file, where Y is up, in Blender, where Z is."""
    return np.asarray(points, dtype=float)[..., [0, 2, 1]] * (1.0, -1.0, 1.0)


def segment_at(segments, time: float) -> int:
    """Return the index of the segment at a time, s."""
    return max(index for index, each in enumerate(segments) if each["begins"] <= time + 1e-6)


def moments(segments, own, roots, rate: float) -> list[int]:
    """Return the frames that are shown: events of acts, and walks at equal distances."""
    # A hop is seen at its highest, and other acts at their events.
    shown = [
        highest if roots[highest, 2] - roots[rows[0], 2] > HOP else round(each["event"] * rate)
        for index, each in enumerate(segments)
        if "event" in each
        for rows in [np.flatnonzero(own == index)]
        for highest in [int(rows[np.argmax(roots[rows, 2])])]
    ]
    places = roots[:, :2]
    for index, each in enumerate(segments):
        rows = np.flatnonzero(own == index)
        if each["kind"] != "walk":
            continue
        way = np.linalg.norm(np.diff(places[rows], axis=0), axis=1).cumsum()
        for goal in np.arange(0.0 if index == 0 else WALKING, way[-1], WALKING):
            frame = int(rows[np.searchsorted(way, goal)])
            if all(np.linalg.norm(places[frame] - places[other]) > ARRIVING for other in shown):
                shown.append(frame)
    return sorted(shown)


def freeze(bpy, body, colour) -> None:
    """Keep a copy of the body as it is now."""
    mesh = bpy.data.meshes.new_from_object(
        body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    )
    mesh.materials.clear()
    mesh.materials.append(colour)
    copy = bpy.data.objects.new("frozen body", mesh)
    copy.matrix_world = body.matrix_world.copy()
    bpy.context.scene.collection.objects.link(copy)


def lay_path(bpy, roots, colour) -> None:
    """Lay the path of a segment on the floor as a band."""
    curve = bpy.data.curves.new("path", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.018
    line = curve.splines.new("POLY")
    line.points.add(len(roots) - 1)
    for point, (x, y, _) in zip(line.points, roots, strict=True):
        point.co = (x, y, 0.0, 1.0)
    curve.materials.append(colour)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("frozen path", curve))


def stand_target(bpy, place) -> None:
    """Stand a ball on a post, so that its place over the floor is seen."""
    red = paint(bpy, TARGET)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=BALL, location=place)
    bpy.context.object.name = "frozen ball"
    bpy.context.object.data.materials.append(red)
    middle = (place[0], place[1], place[2] / 2.0)
    bpy.ops.mesh.primitive_cylinder_add(radius=POST, depth=place[2], location=middle)
    bpy.context.object.name = "frozen post"
    bpy.context.object.data.materials.append(red)


def paint(bpy, colour: tuple[float, float, float]):
    """Return a material of one colour."""
    material = bpy.data.materials.new("paint")
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"]
    surface.inputs["Base Color"].default_value = (*colour, 1.0)
    surface.inputs["Specular IOR Level"].default_value = 0.2
    return material


def light_and_look(bpy, scene, middle) -> None:
    """Add floor, sun, sky, and a camera that looks from the right, so that the walk goes right."""
    bpy.ops.mesh.primitive_plane_add(size=60, location=(middle[0], middle[1], 0.0))
    bpy.context.object.data.materials.append(paint(bpy, FLOOR))
    bpy.ops.object.light_add(type="SUN", rotation=(math.radians(35), math.radians(-25), 0.3))
    bpy.context.object.data.energy = 3.0
    aim = bpy.data.objects.new("aim", None)
    aim.location = (middle[0], middle[1] + 0.45, 0.7)
    scene.collection.objects.link(aim)
    bpy.ops.object.camera_add(location=(middle[0] - 8.6, middle[1] + 0.2, 2.5))
    scene.camera = bpy.context.object
    scene.camera.constraints.new("TRACK_TO").target = aim
    scene.camera.data.lens = 36
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*SKY, 1.0)
    scene.world = world
    scene.render.engine, scene.cycles.samples = "CYCLES", 24
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = WIDE, HIGH


def reduce(*paths: str) -> None:
    """Write large pictures as one, the last path: one above another, smaller, in 96 colours."""
    from PIL import Image

    *large, picture = paths
    pictures = [Image.open(path).convert("RGB") for path in large]
    if len(pictures) > 1:
        pictures = [each.crop(FIGURES).resize(SMALL) for each in pictures]
    wide, high = pictures[0].size
    whole = Image.new("RGB", (wide, high * len(pictures)))
    for row, each in enumerate(pictures):
        whole.paste(each, (0, row * high))
    whole.quantize(96, dither=Image.Dither.NONE).save(picture, optimize=True)


(reduce if sys.argv[1].endswith(".png") else draw)(*sys.argv[1:])
