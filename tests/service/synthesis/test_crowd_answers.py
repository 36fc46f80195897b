"""Tests of crowds: each character's pose, placement and level, as in single requests."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from posefield.common.errors import InvalidField, OutsideSamples
from posefield.common.units import UP
from posefield.http import crowd_operations
from posefield.inference.level_selection import Camera, LevelCriteria
from posefield.motion import quat, skeleton
from posefield.motion.clip import Placement
from posefield.question.motion_question import PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import crowd_synthesis, poses
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation import crowd_validation
from posefield.validation.crowd_validation import Blending, CrowdQuestion

COUNT = 60
# The graph answers in float32, and sums a batch in another order than one row; m.
FLOAT32 = 3e-5


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture(scope="module")
def walk(walk_path):
    return next(iter(model_registry.load([walk_path]).models.values()))


def asked(model, count=COUNT, **given):
    """Return a crowd of random controls, performers, times and places."""
    rng = np.random.Generator(np.random.PCG64(2))
    card = model.session.card
    ends = [(c.minimum, c.maximum) for c in card.controls]
    question = CrowdQuestion(
        {
            c.name: rng.uniform(low, high, count)
            for c, (low, high) in zip(card.controls, ends, strict=True)
        },
        rng.uniform(0.0, 0.5, count),
        Placement(rng.uniform(-50.0, 50.0, (count, 3)), rng.uniform(-4.0, 4.0, count)),
        (None, *card.performers),
        rng.integers(0, 1 + len(card.performers), count),
        rng.integers(0, len(card.levels), count),
        "travelling",
        "ok",
    )
    return replace(question, **given)


def joints(rotations, root, offsets, parents):
    local = skeleton.translations(offsets.astype(float), root[:, None].astype(float))
    return skeleton.forward_kinematics(parents, rotations[:, None].astype(float), local)[0][:, 0]


def of(model, found):
    parents = model.session.card.skeleton.parents
    return joints(found.rotations, found.root_position, found.bone_offsets, parents)


def alone(model, question, row):
    """Joints (J, 3) of one character asked for by itself, and what its answer is worth."""
    controls = {name: float(values[row]) for name, values in question.controls.items()}
    time, level = float(question.times[row]), int(question.detail[row])
    who = question.performers[question.performer[row]]
    answer = poses.synthesize_poses(
        model, PoseQuestion(controls=controls, times=[time], performer=who, level=level)
    )
    parents = model.session.card.skeleton.parents
    found = joints(answer.rotations, answer.root_position, answer.bone_offsets[None], parents)
    turn = quat.from_axis_angle(UP, question.placement.headings[row])
    return quat.rotate(turn, found[0]) + question.placement.positions[row], answer.trust


def test_each_character_is_what_it_would_be_alone_where_it_stands(model):
    question = asked(model)
    found = crowd_synthesis.synthesize_crowd(model, question)
    places = of(model, found)
    for row in range(COUNT):
        expected, trust = alone(model, question, row)
        assert np.abs(places[row] - expected).max() < FLOAT32
        assert found.duration[row] == pytest.approx(trust.duration, rel=1e-5)
        assert found.sigma[row] == pytest.approx(trust.sigma, rel=1e-3)
        assert found.supported[row] == trust.supported
    assert set(found.supported) == {True, False}
    assert np.array_equal(found.levels, question.detail)
    assert found.error_px is None and found.warnings == ()
    # Negative controls: another heading, and another level.
    turned = replace(question.placement, headings=question.placement.headings + 0.01)
    others = crowd_synthesis.synthesize_crowd(model, replace(question, placement=turned))
    assert np.abs(of(model, others) - places).max(axis=(1, 2)).min() > 10 * FLOAT32
    finest = crowd_synthesis.synthesize_crowd(
        model, replace(question, detail=np.zeros(COUNT, dtype=int))
    )
    changed = np.abs(of(model, finest) - places).max(axis=(1, 2)) > 10 * FLOAT32
    assert np.array_equal(changed, question.detail > 0)


def test_a_crowd_larger_than_a_call_is_answered_like_its_parts(model):
    most = crowd_synthesis.MOST_ROWS
    question = asked(model, 3 * most + 7)
    whole = crowd_synthesis.synthesize_crowd(model, question)
    rows = np.array([0, 1, most, 2 * most + 5, len(question) - 1])
    part = crowd_synthesis.synthesize_crowd(
        model,
        replace(
            question,
            controls={name: values[rows] for name, values in question.controls.items()},
            times=question.times[rows],
            placement=Placement(
                question.placement.positions[rows], question.placement.headings[rows]
            ),
            performer=question.performer[rows],
            detail=question.detail[rows],
        ),
    )
    gap = np.abs(of(model, whole)[rows] - of(model, part))
    assert gap.max() < FLOAT32
    assert np.abs(of(model, whole)[rows[::-1]] - of(model, part)).max() > 1.0


def test_in_place_a_cycle_goes_nowhere(walk):
    card = walk.session.card
    count = 20
    question = asked(walk, count, detail=np.zeros(count, dtype=int), root="in_place")
    still = replace(
        question, times=np.zeros(count), placement=Placement(np.zeros((count, 3)), np.zeros(count))
    )
    begin = crowd_synthesis.synthesize_crowd(walk, still)
    late = replace(still, times=begin.duration.astype(float))
    end = crowd_synthesis.synthesize_crowd(walk, late)
    assert np.abs(of(walk, end) - of(walk, begin)).max() < 1e-4
    gone = crowd_synthesis.synthesize_crowd(walk, replace(late, root="travelling"))
    assert card.cyclic and np.abs(gone.root_position - end.root_position).max(axis=1).min() > 0.3


def test_what_the_viewer_sees_of_a_level_is_less_than_the_limit(model):
    """Check that each character is within a pixel of the finest level, and 98 % of the joints."""
    camera = Camera(np.array([0.0, 1.7, 0.0]), math.radians(60.0), 1080.0)
    rng = np.random.Generator(np.random.PCG64(4))
    count = 2_000
    positions = np.column_stack(
        [rng.uniform(5.0, 150.0, count), np.zeros(count), rng.uniform(-20.0, 20.0, count)]
    )
    placed = Placement(positions, np.zeros(count))
    question = asked(model, count, placement=placed, detail=LevelCriteria(camera, 1.0, None, None))
    seen = crowd_synthesis.synthesize_crowd(model, question)
    finest = crowd_synthesis.synthesize_crowd(
        model, replace(question, detail=np.zeros(count, dtype=int))
    )
    gaps = np.linalg.norm(of(model, seen) - of(model, finest), axis=-1)
    distances = np.linalg.norm(of(model, finest) - camera.position, axis=-1)
    pixels = gaps / distances * camera.pixels
    assert np.sqrt(np.mean(np.square(pixels), axis=1)).max() < 1.0
    assert np.mean(pixels > 1.0) < 0.02
    coarsest = crowd_synthesis.synthesize_crowd(model, replace(question, detail=np.full(count, 3)))
    gaps = np.linalg.norm(of(model, coarsest) - of(model, finest), axis=-1)
    assert np.mean(gaps / distances * camera.pixels > 1.0) > 0.04


def test_who_is_between_two_levels_is_between_their_poses(model):
    question = asked(model, detail=np.full(COUNT, 3))
    before = crowd_synthesis.synthesize_crowd(
        model, replace(question, detail=np.zeros(COUNT, dtype=int))
    )
    after = crowd_synthesis.synthesize_crowd(model, question)

    def mixed(share):
        shares = np.full(COUNT, share)
        blending = Blending(np.zeros(COUNT, dtype=int), shares)
        return of(
            model, crowd_synthesis.synthesize_crowd(model, replace(question, blending=blending))
        )

    assert np.abs(mixed(1.0) - of(model, after)).max() < FLOAT32
    assert np.abs(mixed(0.0) - of(model, before)).max() < FLOAT32
    half = mixed(0.5)
    whole = np.linalg.norm(of(model, after) - of(model, before), axis=-1)
    for end in (before, after):
        way = np.linalg.norm(half - of(model, end), axis=-1)
        moved = whole > 0.02
        assert np.median(way[moved] / whole[moved]) == pytest.approx(0.5, abs=0.02)
        assert np.all(way[moved] < 0.75 * whole[moved])
    assert np.linalg.norm(
        crowd_synthesis.synthesize_crowd(
            model,
            replace(question, blending=Blending(np.zeros(COUNT, dtype=int), np.full(COUNT, 0.3))),
        ).rotations,
        axis=-1,
    ) == pytest.approx(1.0, abs=1e-5)


def broken(model, field, row, value):
    question = asked(model)
    if field.startswith("controls/"):
        column = question.controls[field.partition("/")[2]].copy()
        column[row] = value
        name = field.partition("/")[2]
        return replace(question, controls={**question.controls, name: column})
    if field == "time":
        times = question.times.copy()
        times[row] = value
        return replace(question, times=times)
    levels = question.detail.copy()
    levels[row] = value
    return replace(question, detail=levels)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("time", -0.1, "expected 0 s or later"),
        ("time", 60.0, "60 s, expected 0 to 1"),
        ("level", 4, "expected 0 to 3"),
        ("level", -1, "expected 0 to 3"),
        ("controls/stature", 1e9, "expected -"),
    ],
)
def test_what_is_wrong_with_one_character_names_it(model, field, value, said):
    with pytest.raises(InvalidField, match=said) as caught:
        crowd_synthesis.synthesize_crowd(model, broken(model, field, 17, value))
    assert (caught.value.field, caught.value.index) == (field, 17)


def test_outside_the_samples_is_said_once_a_control_or_refused(model):
    high = model.session.card.control("stature").maximum
    question = broken(model, "controls/stature", 9, high + 0.05)
    assert crowd_synthesis.synthesize_crowd(model, question).warnings == ()
    found = crowd_synthesis.synthesize_crowd(model, replace(question, extrapolate="warn"))
    outside, gap = found.warnings
    assert "stature of 1 characters" in outside
    assert "the first is character 9" in outside
    beside = ~found.supported & (np.arange(COUNT) != 9)
    first = int(np.argmax(beside))
    assert f"character {first}, the first of {np.count_nonzero(beside)}, lies in a gap" in gap
    with pytest.raises(OutsideSamples, match="the first is character 9") as caught:
        crowd_synthesis.synthesize_crowd(model, replace(question, extrapolate="refuse"))
    assert (caught.value.field, caught.value.index) == ("controls/stature", 9)


FEW, TIME = 6, 0.3


def taken_question(model, count=FEW, **asked):
    """A crowd of equal characters in the middle of what was sampled."""
    controls = {c.name: [c.default] * count for c in model.session.card.controls}
    body = {"controls": controls, "time": TIME, **asked}
    return crowd_operations.of_body(json.dumps(body).encode(), 1e5)


def crowd(model, **asked):
    return crowd_synthesis.synthesize_crowd(model, taken_question(model, **asked))


def apart(a, b):
    """Largest difference (N,) of the rotations of each character."""
    return np.abs(a.rotations - b.rotations).max(axis=(1, 2))


def test_no_two_characters_of_other_seeds_are_alike(walk):
    plain, taken = crowd(walk), crowd(walk, take="index")
    assert apart(plain, crowd(walk, take=0)).max() == 0.0
    assert apart(plain, taken).min() > 1e-4
    assert apart(taken, crowd(walk, take=[1, 2, 3, 4, 5, 6])).max() == 0.0
    pairs = np.abs(taken.rotations[:, None] - taken.rotations).max(axis=(2, 3))
    assert pairs[~np.eye(FEW, dtype=bool)].min() > 1e-4
    alike = crowd(walk, take=7).rotations
    assert np.abs(alike - alike[0]).max() < 1e-6
    assert np.array_equal(taken.duration, plain.duration)


def test_a_character_has_the_pose_of_its_take(model):
    found = crowd(model, take=[0, 7, 8, 7, 0, 9], variety=[1, 1, 1, 0.5, 1, 1])
    controls = {c.name: c.default for c in model.session.card.controls}
    for row, (take, variety) in enumerate([(0, 1), (7, 1), (8, 1), (7, 0.5)]):
        asked = PoseQuestion(controls=controls, times=[TIME], take=take, variety=variety)
        # The take of a motion that is no cycle has a duration of its own, but not in a crowd.
        duration = poses.synthesize_poses(model, asked).trust.duration
        times = [float(TIME * duration / found.duration[row])]
        pose = poses.synthesize_poses(model, structs.replace(asked, times=times))
        assert np.abs(pose.rotations[0] - found.rotations[row]).max() < 2e-6
        assert np.abs(pose.root_position[0] - found.root_position[row]).max() < 2e-6


def test_too_many_takes_are_refused(walk):
    most = crowd_validation.MAX_TAKES
    seeds = [1] * (most + 1)
    with pytest.raises(InvalidField, match=f"take: {most + 1} characters with takes"):
        crowd_synthesis.synthesize_crowd(walk, taken_question(walk, most + 1, take=seeds))
    card = walk.session.card
    spherical = replace(card, kriging=replace(card.kriging, covariance="spherical"))
    with pytest.raises(InvalidField, match="take: given, but no takes can be drawn of spherical"):
        crowd(Synthesizer("walk", replace(walk.session, card=spherical)), take=3)
