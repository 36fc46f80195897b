"""Crowds as actors of Gazebo: a world in SDF beside a folder of motions in BVH, in metres.

Each motion has the travel of its person in the world, so an actor has no trajectory of its own, and
waits for the time at which the person appears. Its pose turns the motion's Y up into Z up.
"""

import re
from pathlib import Path
from xml.sax import saxutils

import numpy as np

from posefield.common import atomic_files, cancellation
from posefield.common.errors import FileError
from posefield.encode import bone_motion
from posefield.motion import bvh_writer, skeleton
from posefield.motion.clip import Clip, CrowdClip

SKIN = "skin.dae"
"""Mesh of the actors, which users add: rigged with the joints of the model."""
MOTION_FILE = re.compile(r"m\d{5,}\.bvh")
UPRIGHT = f"0 0 0 {np.pi / 2:.12g} 0 0"


def write(crowd: CrowdClip, path: Path) -> None:
    """Write a world in SDF and the folder `<stem>_motions` beside it atomically.

    Raises FileError if other files are in the folder, which would be lost.
    """
    folder = path.with_name(f"{path.stem}_motions")
    for file in [folder] if folder.is_file() else sorted(folder.glob("*")):
        if not (MOTION_FILE.fullmatch(file.name) or file.name == SKIN):
            raise FileError(file, "in the way; expected nothing but an earlier crowd's motions")
    names, actors = bone_motion.people(crowd), []
    with atomic_files.replacing_pair(path, folder) as (world, inside):
        if (folder / SKIN).is_file():
            (inside / SKIN).write_bytes((folder / SKIN).read_bytes())
        for motion in bone_motion.character_motions(crowd):
            cancellation.check()
            local = skeleton.translations(motion.offsets, motion.roots)
            clip = Clip(crowd.skeleton, motion.rotations, local, crowd.rate)
            name = f"m{motion.index:05}.bvh"
            (inside / name).write_bytes(bvh_writer.dumps(clip, metres_per_unit=1.0))
            delay = motion.first / crowd.rate
            actors.append((motion.index, _actor(names[motion.index], folder.name, name, delay)))
        body = "".join(actor for _, actor in sorted(actors))
        world.write_text(
            f'<?xml version="1.0"?>\n<sdf version="1.9">\n<world name="crowd">\n{body}</world>\n'
            "</sdf>\n"
        )


def _actor(person: str, folder: str, file: str, delay: float) -> str:
    name, source = saxutils.quoteattr(person), saxutils.escape(f"{folder}/{file}")
    return f"""<actor name={name}>
  <pose>{UPRIGHT}</pose>
  <skin><filename>{saxutils.escape(folder)}/{SKIN}</filename></skin>
  <animation name="motion"><filename>{source}</filename></animation>
  <script><loop>false</loop><delay_start>{delay:.9g}</delay_start><auto_start>true</auto_start></script>
</actor>
"""
