"""Tests of `posefield adapt` on a model with performers and styles."""

import numpy as np
import pytest
from families import sample_walk
from families.sample_walk import STYLES

from posefield.inference import session
from posefield.motion import bvh_writer

SWAY = 0.06
SAID = ("--performer", "cy", "--unit", "1", "--up", "y", "--licence", "CC0-1.0")
SHOWN = ((0.8, -0.3, "plain"), (1.1, 0.3, "marching"), (1.4, 0.0, "sneaking"))


def stride(speed, turn, style):
    return sample_walk.walk_stride(speed, turn, SWAY, STYLES[style])


@pytest.fixture
def table(tmp_path):
    """Table of three strides of a third walker, each in another style."""
    rows = ["file,haste,veer,style"]
    for index, (speed, turn, style) in enumerate(SHOWN):
        clip = stride(speed, turn, style)
        (tmp_path / f"{index}.bvh").write_bytes(bvh_writer.dumps(clip, metres_per_unit=1.0))
        rows.append(f"{index}.bvh,{3.6 * speed},{1000 * turn},{style}")
    path = tmp_path / "cy.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def distance(opened, clip, controls, weights):
    """Distance, m, of the root path from a stride's, at shares of their durations."""
    times = np.linspace(0.0, 1.0, 11)
    (seconds,) = opened.run(controls, None, "duration", labels=weights)
    (root,) = opened.run(controls, times[None] * seconds[:, None], "root_position", labels=weights)
    true = clip.root_path[np.round(times * (len(clip) - 1)).astype(int)]
    return float(np.sqrt(np.mean(np.sum(np.square(root[0] - true), axis=1))))


def test_a_newcomer_in_one_style_is_known_in_the_others(posefield, styled_path, table, tmp_path):
    path = tmp_path / "new.onnx"
    code, _, err = posefield("adapt", styled_path, "--table", table, "-o", path, *SAID)
    assert code == 0, err
    opened = session.load(path)
    names = {own.name: own.names for own in opened.card.labels}
    assert names == {"performer": ("ann", "ben", "cy"), "style": tuple(sorted(STYLES))}
    assert [opened.card.clip_names(i)["style"] for i in (-3, -2, -1)] == [s for *_, s in SHOWN]
    # A stride in a style and at a speed in which the newcomer was never shown.
    clip, controls = stride(0.9, 0.1, "sneaking"), np.array([[3.6 * 0.9, 100.0]])
    own = distance(opened, clip, controls, np.array([[0.0, 0, 1, 0, 0, 1]]))
    unknown = distance(opened, clip, controls, np.zeros((1, 6)))
    other = distance(opened, clip, controls, np.array([[0.0, 0, 1, 1, 0, 0]]))
    assert own < 0.02 and own < 0.7 * min(unknown, other)


def test_one_style_of_all_clips_may_be_an_option(posefield, styled_path, table, tmp_path):
    lines = table.read_text().splitlines()
    first = lines[0].removesuffix(",style"), lines[1].removesuffix(",plain")
    table.write_text("\n".join(first) + "\n")
    path = tmp_path / "new.onnx"
    asked = ("adapt", styled_path, "--table", table, "-o", path, *SAID)
    for more, said in (
        ((), "no column 'style' (a label set)"),
        (("--label", "stile=plain"), "'stile' (did you mean 'style'?), expected one of style"),
        (("--label", "style"), "label: 'style', expected SET=NAME"),
    ):
        code, _, err = posefield(*asked, *more)
        assert code and said in err
    code, _, err = posefield(*asked, "--label", "style=plain")
    assert code == 0, err
    assert session.load(path).card.clip_names(-1) == {"performer": "cy", "style": "plain"}
