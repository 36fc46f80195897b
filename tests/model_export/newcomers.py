"""A small family of three performers and a fourth unseen one, as files and as a model."""

from pathlib import Path

import numpy as np
from minimal import plain_recipe, small_clip, write_clips

from posefield.motion.clip import Clip
from posefield_train.source.recipe import Recipe

CLIPS = 15
# How far each performer's swing is ahead of a.
AHEAD = {"a": 0.0, "b": 0.5, "d": 1.0, "cy": 1.4}


def recipe() -> Recipe:
    """Recipe of a family that tells its performers apart."""
    plain = plain_recipe()
    plain["clips"]["performer"] = "who"
    plain["kriging"] = {"label": "performer", "covariance": "matern52", "drift": 1}
    plain["event"] = {"joint": "LeftHand", "at": "end"}
    return Recipe.model_validate(plain)


def clip(who: str, control: float, frames: int = 31) -> Clip:
    """Clip of a performer at a value of the control, on bones of their own size."""
    found = small_clip(0.4 * np.sin(0.5 * control) + AHEAD[who], frames)
    size = 1.0 + 0.05 * AHEAD[who]
    translations = found.translations * size
    return Clip(found.skeleton, found.rotations, translations, found.rate)


def write(folder: Path) -> Path:
    """Folder of the family, clips.csv, and of the newcomer's clips, cy.csv."""
    names = ["abd"[i % 3] for i in range(CLIPS)]
    jitter = np.random.Generator(np.random.PCG64(3)).integers(0, 9, CLIPS).tolist()
    clips = [clip(who, float(i), 25 + jitter[i]) for i, who in enumerate(names)]
    write_clips(folder, clips)
    rows = [f"{i}.bvh,{i},{who}" for i, who in enumerate(names)]
    (folder / "clips.csv").write_text("\n".join(["file,v,who", *rows]) + "\n")
    return folder


def write_newcomer(folder: Path, controls: tuple[float, ...], who: str = "cy") -> Path:
    """Folder of a performer's clips and the table cy.csv that lists them."""
    write_clips(folder, [clip(who, value) for value in controls])
    rows = [f"{i}.bvh,{value:g}" for i, value in enumerate(controls)]
    table = folder / "cy.csv"
    table.write_text("\n".join(["file,speed", *rows]) + "\n")
    return table
