"""Pictures of one clip at its event, as it was captured and as several methods have it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from model_export.evaluate.stills import CAPTURED, Still, Stills
from model_export.report import picture
from model_export.report.picture import Picture
from service.motion.conventions import UP, Floats

MARGIN = 0.15


@dataclass(frozen=True)
class Scene:
    """Methods under the words that are said of them, on one clip, with whose bones they are."""

    clip: str
    stills: dict[str, Still]
    parents: tuple[int, ...]

    def paint(self, figure: Figure) -> None:
        """A panel a method: it in orange over the captured body, from where the reach is seen."""
        truth = self.stills[CAPTURED]
        across = _side(truth)
        panels = figure.subplots(1, len(self.stills), sharex=True, sharey=True, squeeze=False)[0]
        for ax, (words, own) in zip(panels, self.stills.items(), strict=True):
            if own is not truth:
                self._body(ax, truth, across, picture.FAINT)
            self._body(ax, own, across, picture.INK if own is truth else picture.ORANGE)
            away = 100.0 * float(np.linalg.norm(own.event - truth.event))
            said = words if own is truth else f"{words}: {away:.1f} cm off"
            ax.plot(*_flat(truth.event[None], across).T, "+", color=picture.INK, markersize=14)
            ax.set(title=said, aspect="equal")
            ax.grid(visible=False)
            ax.tick_params(length=0, labelbottom=False, labelleft=False)
            ax.spines[:].set_visible(False)

    def _body(self, ax: Axes, own: Still, across: Floats, colour: str) -> None:
        joints = _flat(own.joints, across)
        bones = [(joints[j], joints[p]) for j, p in enumerate(self.parents) if p >= 0]
        ax.add_collection(LineCollection(bones, colors=colour, linewidths=1.6))
        ax.plot(*_flat(own.path, across).T, color=colour, linewidth=0.9, linestyle=":")
        low, high = joints.min(axis=0) - MARGIN, joints.max(axis=0) + MARGIN
        ax.update_datalim([low, high])
        ax.autoscale_view()


def drawn(name: str, scene: Scene, caption: str) -> Picture:
    """Picture of a clip by several methods."""
    alt = f"Bodies of {scene.clip} at its event: {', '.join(scene.stills)}."
    return picture.draw(name, 3.6, partial(Scene.paint, scene), alt, caption)


def scene(
    stills: Stills, words: Mapping[str, str], clip: str, place: int, parents: tuple[int, ...]
) -> Scene:
    """A clip by methods under words."""
    found = {CAPTURED: stills[CAPTURED][place]}
    found |= {said: stills[name][place] for name, said in words.items()}
    return Scene(clip, {said: own for said, own in found.items() if own}, parents)


def _flat(points: Floats, across: Floats) -> Floats:
    return points @ np.stack([across, UP], axis=1)


def _side(truth: Still) -> Floats:
    """Horizontal direction (3,) along which the effector goes farthest."""
    way = (truth.path - truth.path.mean(axis=0)) * (1.0 - UP)
    _, vectors = np.linalg.eigh(way.T @ way)
    across: Floats = vectors[:, -1]
    return across if across[2] + 1e-3 * across[0] >= 0 else -across
