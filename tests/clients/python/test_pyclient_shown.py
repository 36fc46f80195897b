"""Tests of what people see: representations, pictures in notebooks, and errors with a hint."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
import scripted
from msgspec import structs
from posefield_client import NEVER, AsyncClient, Client, errors, notebook
from posefield_client.generated import Trust
from posefield_client.numbers import ClipNumbers, Pose

from posefield.motion import skeleton

ADDRESS = "http://127.0.0.1:9"
FRAMES, JOINTS, RATE = 40, 4, 30.0
PARENTS = (-1, 0, 1, 0)


@pytest.fixture
def numbers(rng):
    """Return a clip of random rotations; its model's name has to be escaped."""
    trust = Trust(
        model="<walk>@0123456789abcdef",
        controls={"speed": 1.0},
        performer=None,
        level=0,
        duration=FRAMES / RATE,
        sigma=0.0123,
        warnings=["1 < 2"],
        supported=True,
    )
    turns = rng.normal(size=(FRAMES, JOINTS, 4))
    return ClipNumbers(
        trust,
        {"length": "m", "up": "Y"},
        ("a", "b", "c", "d"),
        PARENTS,
        RATE,
        np.arange(FRAMES) / RATE,
        turns / np.linalg.norm(turns, axis=-1, keepdims=True),
        rng.normal(size=(FRAMES, 3)),
        rng.normal(size=(JOINTS, 3)),
    )


@pytest.mark.parametrize("kind", [Client, AsyncClient])
def test_objects_say_their_model_and_question(kind):
    client = kind(ADDRESS)
    name, model = kind.__name__, client.model("walk")
    begun = "Async" if kind is AsyncClient else ""
    assert repr(client) == f"{name}('{ADDRESS}')"
    assert repr(model) == f"{begun}Model('walk')"
    assert repr(model.clip(speed=1.2, fps=60)) == f"{begun}Clip('walk', speed=1.2, fps=60)"
    assert repr(model.crowd_walk(count=3)) == f"{begun}Saving('walk', count=3)"
    assert repr(model.clips([{"controls": {}}], "glb")) == f"{begun}Saving('walk', 1 clips as glb)"
    crowd = model.crowd(np.zeros(500), speed=1)
    assert repr(crowd) == f"{begun}Crowd('walk', speed=1, time=<500 items>)"


def test_arrays_are_shown_by_their_shapes(numbers):
    said = repr(numbers)
    assert said.startswith("ClipNumbers(trust=<<walk>@0123456789abcdef, sigma 0.0123 m>, ")
    assert "rotations=<float64 (40, 4, 4)>" in said and "names=<4 items>" in said
    assert len(said) < 400
    pose = Pose(numbers.trust, *(np.zeros(3),) * 4)
    assert repr(pose).startswith("Pose(trust=<") and "times=<float64 (3,)>" in repr(pose)


def test_the_picture_is_well_formed_and_needs_nothing_else(numbers):
    text = notebook.picture(numbers)
    figure = ET.fromstring(text.replace("<br>", "<br/>"))
    assert {each.tag for each in figure.iter()} <= {
        *("figure", "svg", "path", "animate", "figcaption", "br"),
    }
    animate = figure.find(".//animate")
    pictures = animate.get("values").split(";")
    assert 2 <= len(pictures) <= notebook.MAX_PICTURES
    assert figure.find(".//path").get("d") == pictures[0]
    # A whole number of clips, about a whole turn of the view.
    repeats = float(animate.get("dur")[:-1]) / ((FRAMES - 1) / RATE)
    assert repeats == pytest.approx(round(repeats), abs=1e-3)
    caption = "".join(figure.find("figcaption").itertext())
    assert caption == "<walk>@0123456789abcdef: 1.30 s, give or take 1.2 cm1 < 2"
    assert len(text) < 100_000


def test_the_figure_is_that_of_forward_kinematics(numbers):
    """Oracle: the service's own. Negative control: another order of joints is far off."""
    arms = np.broadcast_to(numbers.bone_offsets, (FRAMES, JOINTS, 3)).copy()
    arms[:, 0] = numbers.root_position
    expected = skeleton.positions(PARENTS, numbers.rotations, arms)
    found = notebook.positions(numbers)
    assert np.abs(found - expected).max() < 1e-12
    assert np.abs(found[:, ::-1] - expected).max() > 0.1


def test_all_points_of_the_picture_are_inside_it(numbers):
    figure = ET.fromstring(notebook.picture(numbers).replace("<br>", "<br/>"))
    for path in figure.find(".//animate").get("values").split(";"):
        points = np.array([p.split() for p in path.replace("L", "M").split("M")[1:]], float)
        assert points.shape == (2 * (JOINTS - 1), 2)
        assert (points >= 0).all()
        assert (points <= [notebook.WIDTH, notebook.HEIGHT]).all()


def test_a_notebook_shows_why_there_is_no_picture():
    html = Client(ADDRESS, retry=NEVER).model("walk").clip(speed=1)._repr_html_()
    assert html.startswith("<pre>Clip(&#x27;walk&#x27;, speed=1): ")


@pytest.mark.parametrize("kind", ["folder", "file"])
def test_a_file_that_cannot_be_written_is_named_as_it_was_asked_for(tmp_path, kind):
    wanted = tmp_path / kind / "clip.usdc"
    if kind == "file":
        (tmp_path / kind).touch()
    with scripted.serving() as server, Client(server.address, retry=NEVER) as client:
        with pytest.raises(OSError) as caught:
            client.model("reach").clip(turn=1).save(wanted)
    assert type(caught.value) is (FileNotFoundError if kind == "folder" else NotADirectoryError)
    assert caught.value.filename == str(wanted) and ".part" not in str(caught.value)


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda m: m.clip(perfomer="kim"), "perfomer (did you mean 'performer'?) is 'kim', exp"),
        (lambda m: m.clip().content("usdq"), "format 'usdq' (did you mean 'usdz'?), expected one"),
        (lambda m: m.clips([], "glbb"), "format 'glbb' (did you mean 'glb'?), expected one of"),
        (
            lambda m: m.pose(0, targets=[{"joint": "a", "postion": [0, 1, 2], "at": "end"}]),
            "target 0: Object contains unknown field `postion` (did you mean 'position'?), "
            "expected some of joint, position, time, at",
        ),
        (lambda m: m.clip(speed="fast"), "speed is 'fast', expected a finite number"),
    ],
)
def test_a_misspelt_name_is_answered_with_a_known_one(ask, said):
    with pytest.raises(errors.WrongQuestion) as caught:
        ask(Client(ADDRESS).model("walk"))
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_the_figure_stands_upright(numbers, up):
    """One bone upwards and one to each side: the first joint is the highest of the picture."""
    turns = np.zeros((FRAMES, JOINTS, 4))
    turns[..., 0] = 1.0
    along = np.array([[0, 0, 0], [0, 1, 0], [0.3, 0, 0], [-0.3, 0, 0]], float)
    if up == "Z":
        # Y up, +Z ahead becomes Z up, -Y ahead.
        along = along[:, [0, 2, 1]] * np.array([1.0, -1.0, 1.0])
    parents = (-1, 0, 0, 0)
    still = structs.replace(
        numbers,
        units={"up": up},
        parents=parents,
        rotations=turns,
        root_position=np.zeros((FRAMES, 3)),
        bone_offsets=along,
    )
    figure = ET.fromstring(notebook.picture(still).replace("<br>", "<br/>"))
    for path in figure.find(".//animate").get("values").split(";"):
        points = np.array([p.split() for p in path.replace("L", "M").split("M")[1:]], float)
        assert points[1, 1] == points[:, 1].min() < points[0, 1] - 50
