"""Tests of the plans and poses of walks, with the shipped model of captured walks."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import posefield
from posefield.common.errors import InvalidField, MotionError
from posefield.constraints.take_variation import TakeSettings
from posefield.inference import session
from posefield.locomotion import floor_plane, gait
from posefield.model_file.model_card import mean_accelerations
from posefield.motion import quat, skeleton
from posefield.performance import composition, walk_entries
from posefield.performance.passage import RATE, FloorMotion
from posefield.performance.walk_plan import STEP_END, plan_walk
from posefield.performance.walk_request import Disc, WalkRequest
from posefield.synthesis import walking_feet
from posefield.synthesis.synthesizer import Synthesizer

ORIGIN = FloorMotion()
BENDS = np.array([[0, 0], [1, 4], [0, 8], [-1, 12], [0, 16], [0, 22]], dtype=float)
CHANGES = ((0.0, 0.8), (7.0, 0.8), (10.0, 1.4), (16.0, 1.4), (18.0, 1.0))
BOTH = {"start": "standing", "stop": "standing"}


def circle(radius):
    """Return waypoints of a circle to the left."""
    at = np.linspace(0.0, 2.0 * np.pi, 13)
    return radius * np.column_stack([1.0 - np.cos(at), np.sin(at)])


WALKS = {
    "straight": WalkRequest(1.2, to=(0.0, 20.0)),
    "changes": WalkRequest(CHANGES, to=(0.0, 24.0)),
    "changes from standing": WalkRequest(CHANGES, to=(0.0, 24.0), **BOTH),
    "bends from standing": WalkRequest(1.0, along=BENDS, **BOTH),
    "circle": WalkRequest(1.0, along=circle(6.0)),
    "turning over time": WalkRequest(
        1.1, seconds=10.0, turn=((0.0, 0.0), (2.0, 0.25), (8.0, -0.2))
    ),
    "to behind": WalkRequest(1.0, to=(-3.0, -4.0)),
    "to an end": WalkRequest(1.1, end=FloorMotion(1.5, 8.0 + 3.0j)),
}


@pytest.fixture(scope="module")
def walk(shipped_walk):
    return shipped_walk


@pytest.fixture(scope="module")
def walking(walk):
    return gait.fit_gait(walk.session)


def planned(walking, request, start=ORIGIN, phase=0.1):
    return plan_walk(walking, request, None if request.along is not None else start, phase)


@pytest.mark.parametrize("name", WALKS)
def test_walks_follow_their_paths(walk, walking, name):
    plan = planned(walking, WALKS[name])
    made = walk_entries.walk_passage(walk, plan)
    found = composition.path_errors(plan, made.roots, made.rotations)
    assert found.lateral < 0.005
    assert found.along < 0.005
    assert np.degrees(found.heading) < 0.7
    assert np.degrees(found.facing) < 1.0
    assert found.speed < 0.015
    # The measure sees a body that is 2 cm beside its path and one that crabs.
    left = np.exp(1j * plan.path.at(plan.distances)[1]) * 0.02j
    beside = made.roots + floor_plane.at_height(left, np.zeros(len(plan)))
    assert composition.path_errors(plan, beside, made.rotations).lateral > 0.015
    crabs = made.roots + floor_plane.at_height(0.03 * plan.distances * 1j, np.zeros(len(plan)))
    assert np.degrees(composition.path_errors(plan, crabs, made.rotations).heading) > 0.7


@pytest.mark.parametrize("name", WALKS)
def test_the_phase_advances_by_the_distance_over_the_stride(walking, name):
    plan = planned(walking, replace(WALKS[name], stop="rolling"))
    ways = np.abs(plan.walker.strides(plan.controls).travels)
    by = np.diff(plan.phases) * 0.5 * (ways[1:] + ways[:-1])
    gone = np.diff(plan.distances)
    # A turn that no walker was captured in takes steps of its own.
    turning = plan.speeds * np.interp(plan.distances, plan.path.distances, plan.path.curvatures)
    right, left = walking.region.turning(plan.speeds)
    captured = ((turning < left + 0.3) & (turning > right - 0.3))[1:]
    # So does an opening step.
    captured[: round(STEP_END * RATE) if WALKS[name].start == "standing" else 0] = False
    assert captured.mean() > 0.5
    assert np.allclose(by[captured], gone[captured], rtol=2e-3, atol=1e-7)
    assert (by > gone * (1.0 - 2e-3)).all()
    shorter = 0.99 * by
    assert not np.allclose(shorter[captured], gone[captured], rtol=2e-3, atol=1e-7)


def test_a_walk_stops_in_double_support_after_a_foot_swung_past_the_other_at_rest(walking):
    for length in (6.0, 6.3, 6.6, 6.9, 7.2):
        plan = planned(walking, WalkRequest(1.2, to=(0.0, length), **BOTH))
        for phase in (plan.phases[0], plan.phases[-1]):
            assert np.abs((plan.steps.poses.supports - phase + 0.5) % 1.0 - 0.5).min() < 0.01
        assert plan.speeds[0] < 0.02
        assert plan.speeds[-1] < 0.02
        passings = np.sort((plan.phases[-1] - plan.steps.poses.passings[0]) % 1.0)
        passed = np.interp(plan.phases[-1] - passings[0], plan.phases, plan.distances)
        assert plan.distances[-1] - passed < 0.12
        # Strides are scaled by 6 % at most.
        ways = np.abs(plan.walker.strides(plan.controls).travels)
        shares = np.diff(plan.phases) * ways[1:] / np.diff(plan.distances)
        end = round(STEP_END * RATE)
        assert np.abs(shares[end:-end] - 1.0).max() < 0.065


def test_speeds_are_those_of_the_curve_over_distance_and_over_time(walking):
    over_distance = planned(walking, WALKS["changes"])
    knots, speeds = np.array(CHANGES).T
    wanted = np.interp(over_distance.distances, knots, speeds)
    assert np.abs(over_distance.speeds - wanted).max() < 0.03
    curve = ((0.0, 0.8), (3.0, 1.4))
    over_time = planned(walking, WalkRequest(curve, seconds=6.0, speed_over="time"))
    wanted = np.interp(np.arange(len(over_time)) / RATE, *np.array(curve).T)
    assert np.abs(over_time.speeds - wanted).max() < 0.03
    reached = planned(walking, WalkRequest(curve, to=(0.0, 9.0), speed_over="time"))
    assert (
        np.abs(reached.speeds - np.interp(np.arange(len(reached)) / RATE, *np.array(curve).T)).max()
        < 0.03
    )
    assert reached.end.shift == pytest.approx(9.0)


def test_a_walk_begins_at_the_speed_of_the_one_before(walking):
    first = planned(walking, WalkRequest(1.3, to=(0.0, 8.0)))
    speed, turn = first.exit_rates
    then = WalkRequest(0.9, seconds=6.0, turn=0.1, entry_speed=speed, entry_turn=turn)
    plan = plan_walk(walking, then, first.end, float(first.phases[-1]))
    assert np.abs(plan.controls[0] - first.controls[-1]).max() < 0.02
    assert plan.speeds[-1] == pytest.approx(0.9, abs=0.01)
    assert plan.exit_rates[1] == pytest.approx(0.1, abs=0.01)
    assert abs(plan.places[0] - first.places[-1]) < 0.01
    apart = plan_walk(walking, replace(then, entry_speed=None), first.end, 0.0)
    assert np.abs(apart.controls[0] - first.controls[-1]).max() > 0.2


def test_accelerations_are_comfortable(walking):
    plan = planned(walking, WalkRequest(1.2, to=(0.0, 20.0), **BOTH))
    found = np.diff(plan.speeds)[2:-2] * RATE
    assert np.abs(found).max() < 0.41
    brisk = planned(walking, WalkRequest(1.2, to=(0.0, 20.0), acceleration=1.2, **BOTH))
    assert np.abs(np.diff(brisk.speeds)[2:-2] * RATE).max() > 1.0
    assert len(brisk) < len(plan)


def test_given_controls_and_performers_are_kept(walking):
    plan = planned(walking, WalkRequest(1.1, to=(0.0, 8.0), controls={"stride_length": 1.2}))
    column = [each.name for each in plan.walker.card.controls].index("stride_length")
    assert np.all(plan.controls[:, column] == 1.2)
    assert plan.walker.strides(plan.controls[:1]).speeds == pytest.approx(1.1, abs=0.01)
    own, other = plan.walker.card.performers[:2]
    named = planned(walking, WalkRequest(1.1, to=(0.0, 8.0), labels={"performer": own}))
    mixed = WalkRequest(1.1, to=(0.0, 8.0), labels={"performer": {own: 0.5, other: 0.5}})
    assert named.walker.weights.sum() == 1.0
    assert np.sort(planned(walking, mixed).walker.weights[0])[-2:].tolist() == [0.5, 0.5]
    assert not np.allclose(named.controls[0], planned(walking, WALKS["straight"]).controls[0])


def test_takes_and_details_differ_and_stay_on_the_path(walk, walking):
    plan = planned(walking, WalkRequest(1.1, to=(0.0, 10.0)))
    mean = walk_entries.walk_passage(walk, plan)
    settings = TakeSettings(7, 0.7, detail=True)
    take = walk_entries.walk_passage(walk, plan, take=settings)
    again = walk_entries.walk_passage(walk, plan, take=settings)
    assert take.rotations.tobytes() == again.rotations.tobytes()
    assert np.abs(take.rotations - mean.rotations).max() > 0.01
    assert composition.path_errors(plan, take.roots, take.rotations).lateral < 0.025
    same = walk_entries.walk_passage(walk, plan, take=TakeSettings(0, 0.7, detail=False))
    assert np.allclose(same.rotations, mean.rotations, atol=1e-4)


REFUSED = [
    (WalkRequest(((0, 1.0), (5, 3.0)), to=(0, 5)), "speed/1", "3 m/s"),
    (WalkRequest(((0, 0.6), (0.1, 1.6)), to=(0, 5)), "speed/1", "m/s² from the pair before"),
    (WalkRequest(((0, 1.0, 2.0),), to=(0, 5)), "speed/0", "a pair of numbers"),
    (WalkRequest(1.0, to=(0, float("inf"))), "to/1", "finite"),
    (WalkRequest(1.0, along=np.array([[0, 0.0, 1.0]])), "along", "pairs of finite numbers"),
    (WalkRequest(1.0, along=np.array([[0, 0.0], [0, 1e9]])), "along/1", "1e+09 m away"),
    (WalkRequest(1.0, to=(0, 5), controls={"stride_length": 9}), "controls/stride_length", "9 m"),
    (WalkRequest(1.0, to=(0, 9), obstacles=(Disc(0.1, 4, 0.5),)), "obstacles/0", "within 0.10 m"),
    (WalkRequest(1.0, to=(0, 9), obstacles=(Disc(0, 4, 1),) * 33, detour=True), "obstacles", "33"),
]


@pytest.mark.parametrize(("request_", "field", "said"), REFUSED)
def test_a_walk_that_cannot_be_is_refused_with_its_field(walking, request_, field, said):
    with pytest.raises(InvalidField, match=r"expected|given|asked") as caught:
        planned(walking, request_)
    assert caught.value.field == field
    assert said in str(caught.value)


def test_a_walk_leads_around_obstacles(walking):
    crossed = WalkRequest(1.0, to=(0.0, 14.0), obstacles=(Disc(0.3, 5, 1.0), Disc(-0.5, 9, 0.8)))
    plan = planned(walking, replace(crossed, detour=True))
    for disc in crossed.obstacles:
        assert np.abs(plan.path.places - complex(disc.z, disc.x)).min() > disc.radius
    assert plan.end.shift == pytest.approx(14.0)
    (note,) = [note for note in plan.notes if note.code == "detour"]
    assert note.message.startswith("leads around obstacles and is 0.")
    clear = replace(crossed, obstacles=(Disc(2.0, 5.0, 1.0),), detour=True)
    assert planned(walking, clear).notes == ()
    ring = 4.0 * np.exp(2j * np.pi * np.arange(18) / 18)
    walled = tuple(Disc(point.imag, point.real, 0.9) for point in ring)
    with pytest.raises(InvalidField, match="no way around them"):
        planned(walking, replace(crossed, obstacles=walled, detour=True))


@pytest.mark.parametrize("fixture", ["walk_path", "measured_walk_path"])
def test_models_without_contacts_and_performers_walk(request, fixture):
    model = Synthesizer("walk", session.load(request.getfixturevalue(fixture)))
    own = gait.fit_gait(model.session)
    low, high = own.region.speeds
    plan = planned(own, WalkRequest(0.5 * (low + high), to=(0.0, 8.0), **BOTH))
    made = walk_entries.walk_passage(model, plan)
    found = composition.path_errors(plan, made.roots, made.rotations)
    assert found.lateral < 0.005
    assert found.along < 0.01
    assert np.isfinite(made.rotations).all()
    assert abs(plan.end.shift - 8.0) < 0.01


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(["to", "end", "along", "seconds"]),
    ends=st.tuples(*[st.sampled_from(["rolling", "standing"])] * 2),
)
def test_valid_walks_end_where_they_should(walk, walking, seed, kind, ends):
    rng = np.random.default_rng(seed)
    start = FloorMotion(rng.uniform(-3, 3), complex(*rng.uniform(-5, 5, 2)))
    way = rng.uniform(6.0, 20.0) * np.exp(1j * (start.turn + rng.uniform(-3, 3)))
    place = start.shift + way
    heading = rng.uniform(-3, 3)
    given_ = {
        "to": {"to": (place.imag, place.real)},
        "end": {"end": FloorMotion(heading, place)},
        "along": {"along": gentle_waypoints(rng, start)},
        "seconds": {"seconds": rng.uniform(0.2, 9.0), "turn": rng.uniform(-0.2, 0.2)},
    }[kind]
    speed = rng.uniform(0.6, 1.3)
    request = WalkRequest(speed, **given_, start=ends[0], stop=ends[1])
    plan = plan_walk(walking, request, start, rng.uniform())
    made = walk_entries.walk_passage(walk, plan)
    for array in (made.rotations, made.roots, made.contacts, made.sigmas, made.phases):
        assert np.isfinite(array).all()
    assert np.all(np.diff(plan.phases) >= 0.0)
    assert np.all(np.diff(plan.distances) >= -1e-12)
    assert abs(np.linalg.norm(made.rotations, axis=-1) - 1.0).max() < 1e-4
    if kind in ("to", "end"):
        assert abs(plan.end.shift - place) < 0.01
    if kind == "end":
        assert abs(np.exp(1j * plan.end.turn) - np.exp(1j * heading)) < 1e-3
    if kind == "along":
        assert abs(plan.end.shift - complex(*given_["along"][-1][::-1])) < 0.01
    if kind == "seconds":
        assert (len(plan) - 1) / RATE == pytest.approx(request.seconds, abs=0.5 / RATE)
    again = walk_entries.walk_passage(walk, plan_walk(walking, request, start, plan.phases[0]))
    if ends[0] == "rolling":
        assert again.rotations.tobytes() == made.rotations.tobytes()
        assert again.roots.tobytes() == made.roots.tobytes()


def gentle_waypoints(rng, start):
    """Return waypoints (4, 2) that a walker can follow from a start."""
    turns = start.turn + np.cumsum(rng.uniform(-0.3, 0.3, 4))
    places = start.shift + np.cumsum(5.0 * np.exp(1j * turns))
    return np.column_stack([places.imag, places.real])


def test_corners_and_goals_beside_and_behind_are_walked_on_planned_steps(walk, walking):
    """An L at 1 m/s, three metres to the left, and behind: no refusal, no tour, no sliding foot."""
    corner = np.array([[0.0, 4.0], [4.0, 4.0], [4.0, 8.0]])
    requests = {
        "corner": (WalkRequest(1.0, along=corner, **BOTH), 12.0),
        "left": (WalkRequest(1.1, to=(3.0, 0.0), **BOTH), 3.0),
        "behind": (WalkRequest(1.1, to=(0.0, -4.0), **BOTH), 4.0),
    }
    for request, length in requests.values():
        plan = plan_walk(walking, request, ORIGIN, 0.1)
        assert plan.path.length < 1.5 * length + 0.5
        assert len(plan) < 90.0 * length + 240.0
        assert any(note.code == "turns-beyond-captured" for note in plan.notes)
        turned, whole = (foot_turns(walk, replace(plan, steps=one)) for one in (plan.steps, None))
        assert turned < 0.5 * whole


def foot_turns(walk, plan):
    """Return the mean rate at which standing feet turn in curves, rad/s."""
    made = walk_entries.walk_passage(walk, plan)
    bones = walk.session.run(plan.controls[:1], None, "bone_offsets", labels=plan.walker.labels(1))
    local = skeleton.translations(bones[0][0].astype(float), made.roots)
    joints = skeleton.positions(walk.session.card.skeleton.parents, made.rotations, local)
    curvatures = np.interp(plan.distances, plan.path.distances, plan.path.curvatures)
    turning, rates = np.abs(plan.speeds * curvatures), []
    for foot, contact in enumerate(walking_feet.foot_contacts(walk.session.card)):
        ankle = walk.session.card.skeleton.parents[contact.joint]
        way = floor_plane.project(joints[:, contact.joint] - joints[:, ankle])
        stands = (made.contacts[1:, foot] > 0.95) & (turning[1:] > 0.7)
        rates.append(np.abs(np.angle(way[1:] / way[:-1]))[stands] * RATE)
    return np.concatenate(rates).mean()


WAYS = [((1.5, 0.0), 0.0), ((0.0, -1.0), 0.0), ((0.0, 0.0), 3.1), ((-1.0, 0.5), -0.5)]


@pytest.mark.parametrize(("to", "facing"), WAYS)
def test_a_body_that_faces_one_way_steps_to_its_place_and_no_foot_slides(walk, to, facing):
    card = walk.session.card
    segment = {"kind": "walk", "model": "cmu_walk", "to": to, "facing": facing, **BOTH}
    made = posefield.perform({"segments": [segment], "fps": RATE})
    clip = made.clip
    roots = floor_plane.project(clip.root_path)
    assert abs(roots[-1] - complex(*to[::-1])) < 0.02
    ahead = quat.rotate(clip.rotations[:, 0], np.array([0.0, 0.0, 1.0]))
    faced = np.unwrap(np.angle(floor_plane.project(ahead)))
    assert abs(faced[-1] - facing) < np.radians(10.0)
    turned = np.flatnonzero(np.abs(roots - roots[0]) > 0.1)
    assert not len(turned) or np.abs(faced[turned[0] :] - facing).max() < np.radians(20.0)
    # The negative control: as predicted, feet that should stand slide.
    # No leg crosses the other one: the balls of the feet are beside each other.
    balls = clip.positions()[:, [contact.joint for contact in walking_feet.foot_contacts(card)]]
    left, right = (floor_plane.project(balls) * np.exp(-1j * faced)[:, None]).T
    assert (left - right).imag.min() > 0.05
    feet = made.trust.feet
    assert feet.skate < 0.04 < 0.05 < feet.skate_before
    assert feet.drift < 0.002
    peak = mean_accelerations(clip.positions(), RATE).max()
    assert peak < card.captured_acceleration.p99


def test_a_walk_that_cannot_face_one_way_is_refused():
    segment = {"kind": "walk", "model": "cmu_walk", "facing": 0.0, "to": (1.0, 0.0), **BOTH}
    wrong = {"standing": ("start", "rolling"), "without to": ("to", None), "0.600": ("speed", 1.2)}
    for message, (name, value) in wrong.items():
        with pytest.raises(MotionError, match=message):
            posefield.perform({"segments": [{**segment, name: value}]})
