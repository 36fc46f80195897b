"""Readers of tracks, and what is told of those that cannot be used."""

import sqlite3
from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd, UsdGeom

import posefield
from posefield.common.errors import FileError, InvalidField
from posefield.encode import bone_motion, crowd_writer
from posefield.locomotion import floor_plane
from posefield.locomotion.locomotion_plan import Route
from posefield.performance import step_plan
from posefield.question.walk_question import WalkQuestion
from posefield.tracks import route_tracks, track_crowd, track_files, track_path
from posefield.tracks.track import MAX_PEOPLE, Track, floor_points
from posefield.tracks.track_files import TrackReading

DEGREES = TrackReading("degrees")


@pytest.fixture(scope="module")
def walk():
    return posefield.load("cmu_walk").synthesizer


def write(tmp_path, name, text):
    file = tmp_path / name
    file.write_text(text)
    return file


def sumo(people, time=0.0, **values):
    attributes = {"x": 0.0, "y": 0.0, "angle": 0.0, "speed": 0.0} | values
    text = " ".join(f'{name}="{value}"' for name, value in attributes.items())
    return "".join(
        f'<timestep time="{time}"><person id="{one}" {text}/></timestep>' for one in people
    )


def database(file, rows, fps="10"):
    with sqlite3.connect(file) as connection:
        connection.execute("create table metadata(key text, value text)")
        connection.execute("insert into metadata values ('fps', ?)", [fps])
        columns = "frame integer, id integer, pos_x, pos_y, ori_x, ori_y"
        connection.execute(f"create table trajectory_data({columns})")
        connection.executemany("insert into trajectory_data values (?, ?, ?, ?, ?, ?)", rows)
    connection.close()
    return file


def test_all_formats_give_the_same_person(tmp_path):
    steps = [(0.0, 1.0, 2.0), (0.1, 1.1, 2.2)]
    table = "time,id,x,y,heading\n" + "".join(f"{t},7,{x},{y},90\n" for t, x, y in steps)
    xml = "".join(sumo(["7"], t, x=x, y=y, angle=0) for t, x, y in steps)
    text = "# framerate: 10.0\n#id frame x/m y/m z/m\n" + "".join(
        f"7 {round(10 * t)} {x} {y} 0\n" for t, x, y in steps
    )
    # JuPedSim's first frame has no orientation yet.
    rows = [(round(10 * t), 7, x, y, 0.0, float(t > 0.0)) for t, x, y in steps]
    states = "".join(
        f"<state><position><point><x>{x}</x><y>{y}</y></point></position>"
        f"<orientation><exact>{np.pi / 2}</exact></orientation>"
        f"<time><exact>{round(10 * t)}</exact></time></state>"
        for t, x, y in steps
    )
    road = (
        '<commonRoad timeStepSize="0.1">'
        '<dynamicObstacle id="8"><type>car</type><initialState/></dynamicObstacle>'
        f'<dynamicObstacle id="7"><type>pedestrian</type><trajectory>{states}</trajectory>'
        "</dynamicObstacle></commonRoad>"
    )
    for file in (
        write(tmp_path, "road.xml", road),
        write(tmp_path, "a.csv", table),
        write(tmp_path, "a.xml", f"<fcd-export>{xml}</fcd-export>"),
        database(tmp_path / "a.sqlite", rows),
        write(tmp_path, "a.txt", text),
    ):
        unit = DEGREES if file.suffix == ".csv" else TrackReading()
        (track,) = track_files.read_tracks(file, unit).tracks
        assert track.person == "7"
        np.testing.assert_array_equal(track.times, [0.0, 0.1])
        # East is X, north is -Z.
        np.testing.assert_allclose(track.points, [-2.0 + 1.0j, -2.2 + 1.1j], rtol=1e-12)
        if file.suffix != ".txt":
            np.testing.assert_allclose(np.exp(1j * track.headings), -1.0, atol=1e-12)
        # y down turns the points over, and the headings with them.
        (turned,) = track_files.read_tracks(file, replace(unit, y_down=True)).tracks
        np.testing.assert_array_equal(turned.points, -np.conj(track.points))
        if track.headings is not None:
            np.testing.assert_allclose(np.exp(1j * turned.headings), 1.0, atol=1e-12)
        if file.suffix != ".csv":
            with pytest.raises(InvalidField, match=rf"'degrees', expected none: \{file.suffix}"):
                track_files.read_tracks(file, DEGREES)


HEAD = "time,id,x,y\n"
BAD = [
    ("jump.csv", HEAD + "0,a,0,0\n1,a,30,0\n", "jump.csv:3: person 'a': jumps 30.00 m in 1 s"),
    ("jumps.csv", HEAD + "0,a,0,0\n1,a,30,0\n", "12 m/s; --split parts a person there, --skip-bad"),
    ("twice.csv", HEAD + "0,a,0,0\n0,a,1,0\n", "twice.csv:3: person 'a': twice at time 0 s"),
    ("back.csv", HEAD + "1,a,0,0\n0,a,1,0\n", "goes back from 1 s to 0 s"),
    ("one.csv", HEAD + "1,a,0,0\n", "one sample, expected two or more"),
    ("nan.csv", HEAD + "0,a,0,0\n1,a,nan,0\n", "nan.csv:3: person 'a': x 'nan', expected a number"),
    ("word.csv", HEAD + "0,a,zero,0\n", "word.csv:2: person 'a': x 'zero', expected a number"),
    ("cells.csv", HEAD + "0,a,0\n", "person 'a': 2 numbers, expected time, x, y; --skip-bad"),
    ("id.csv", HEAD + "0,a,0,0\n1,,0,0\n", "id.csv:3: a person without id"),
    ("head.csv", "t,id,x,y\n", "columns t, id, x, y, expected time,id,x,y"),
    ("empty.csv", HEAD, "no person in it"),
    ("a.json", "", "'a.json' ends in none of .xml"),
    ("far.csv", HEAD + "0,a,0,0\n1,a,1e9,0\n", "from the origin, expected at most"),
    ("none.sqlite", "no database", "no SQLite database"),
    ("none.txt", "1 0 0 0 0\n", "expected '# framerate:' above 0"),
    ("none.xml", "<routes/>", "none.xml:1: root element 'routes', expected 'fcd-export'"),
    (
        "state.xml",
        '<commonRoad timeStepSize="0.1"><dynamicObstacle id="7"><type>pedestrian</type>'
        "<initialState/></dynamicObstacle></commonRoad>",
        "state.xml:1: person '7': time 'none exact', expected a number",
    ),
    ("cut.xml", "<fcd-export>", "no XML: no element found"),
    ("bomb.xml", '<!DOCTYPE a [<!ENTITY a "a">]><fcd-export/>', "a document type or an entity"),
]


@pytest.mark.parametrize(("name", "text", "message"), BAD, ids=[name for name, *_ in BAD])
def test_bad_files_are_told_with_line_found_and_expected(tmp_path, name, text, message):
    with pytest.raises((FileError, InvalidField)) as caught:
        track_files.read_tracks(write(tmp_path, name, text))
    assert message in str(caught.value)


def test_headings_need_their_unit_and_agree_with_it(tmp_path):
    file = write(tmp_path, "h.csv", "time,id,x,y,heading\n0,a,0,0,0\n1,a,1,0,90\n")
    with pytest.raises(FileError, match="expected --heading-unit degrees or radians"):
        track_files.read_tracks(file)
    with pytest.raises(FileError, match=r"h.csv:3: .* heading 90 radians, 5156.62 degrees, expec"):
        track_files.read_tracks(file, TrackReading("radians"))
    bare = write(tmp_path, "bare.csv", HEAD + "0,a,0,0\n1,a,1,0\n")
    with pytest.raises(InvalidField, match=r"'degrees', but bare\.csv has no column heading"):
        track_files.read_tracks(bare, DEGREES)
    assert len(track_files.read_tracks(file, DEGREES).tracks) == 1


def test_headings_of_another_frame_than_y_are_told(tmp_path):
    moments, radians = np.linspace(0.0, 6.0, 61), TrackReading("radians")
    rows = "".join(f"{t:.2f},a,{np.sin(t):.4f},{np.cos(t):.4f},{t:.4f}\n" for t in moments)
    down = write(tmp_path, "down.csv", "time,id,x,y,heading\n" + rows)
    with pytest.raises(FileError, match="is one of both turned over"):
        track_files.read_tracks(down, radians)


def test_other_units_and_origins_are_told_as_such(tmp_path):
    """Neither leaving people out nor parting them would help."""

    def said(change, skip_bad=False, **reading):
        rows = "".join(f"{t},a,{x},{y}\n" for t, x, y in map(change, np.arange(0.0, 4.0, 0.1)))
        file = write(tmp_path, "a.csv", HEAD + rows)
        with pytest.raises(FileError) as caught:
            track_files.read_tracks(file, TrackReading(**reading), skip_bad)
        return str(caught.value)

    for size, guess in ((100, "centimetres"), (1000, "millimetres"), (30, "in what unit")):
        for split in (None, 2.0):
            for skip_bad in (False, True):
                text = said(lambda t, s=size: (t, s * 1.2 * t, 0), skip_bad, split=split)
                assert guess in text and "--s" not in text
                if skip_bad and split is None:
                    assert "no usable person among 1, the first 'a': line 3: jumps" in text
    utm = said(lambda t: (t, 690_000 + t, 5_330_000))
    assert "subtract the origin of the map" in utm and "--s" not in utm
    assert "longitude and latitude, not m?" in said(lambda t: (t, 13.0 + 1e-5 * t, 52.0))
    with pytest.raises(pytest.fail.Exception, match="DID NOT RAISE"):  # Who stands, and trembles.
        said(lambda t: (t, 0.001 * (t % 0.2 > 0.05), 0.0))


def test_cells_that_are_no_numbers_leave_out_their_person_in_every_format(tmp_path):
    steps = range(3)
    good, bad = ([(t, who, t + x) for t in steps] for who, x in (("1", 0), ("2", 9)))
    bad[1] = 1, "2", ""
    rows = sorted(good + bad)
    sumo_steps = "".join(sumo([who], t, x=x) for t, who, x in rows)
    files = {
        "a.csv": HEAD + "".join(f"{t},{who},{x},0\n" for t, who, x in rows),
        "a.xml": f"<fcd-export>{sumo_steps}</fcd-export>",
    }
    paths = [write(tmp_path, name, text) for name, text in files.items()]
    data = [(t, int(who), None if x == "" else x, 0.0, 1.0, 0.0) for t, who, x in rows]
    paths.append(database(tmp_path / "a.sqlite", data, fps="1"))
    for path in paths:
        found = track_files.read_tracks(path, skip_bad=True)
        assert [track.person for track in found.tracks] == ["1"] and list(found.skipped) == ["2"]
        assert found.skipped["2"].startswith("line ") and "expected a number" in found.skipped["2"]


def test_a_person_who_rides_is_away_and_comes_back_the_same_person(tmp_path, walk):
    rides = ['vehicle="bus"' if 4 <= t < 8 else "" for t in range(12)]
    steps = "".join(
        f'<timestep time="{t}"><person id="a" x="{t}" y="0" angle="90" {ride}/></timestep>'
        for t, ride in enumerate(rides)
    )
    file = write(tmp_path, "ride.xml", f"<fcd-export>{steps}</fcd-export>")
    found = track_files.read_tracks(file).tracks
    legs = {leg.person: leg.times.tolist() for leg in found}
    assert legs == {"a": [0.0, 1.0, 2.0, 3.0], "a~2": [8.0, 9.0, 10.0, 11.0]}
    found += (replace(found[1], person="b"),)
    crowd = track_crowd.find_people(walk, walk.gait, WalkQuestion(fps=10.0), found)
    first, second, other = crowd.people
    assert (first.scale, first.number, first.take) == (second.scale, second.number, second.take)
    assert other.scale != first.scale


def test_time_without_samples_is_told_and_splits_a_track_where_asked(tmp_path, walk):
    times = [*np.arange(0.0, 3.0, 0.1), *np.arange(6.0, 9.0, 0.1)]
    text = HEAD + "".join(f"{t:.1f},3,{t:.2f},0\n" for t in times) + "9.0,3,50,0\n9.1,3,50.1,0\n"
    jump = write(tmp_path, "jump.csv", text)
    file = write(tmp_path, "a.csv", text.partition("9.0,")[0])
    tracks = track_files.read_tracks(file).tracks
    (told,) = track_crowd.find_people(walk, walk.gait, WalkQuestion(fps=10.0), tracks).limits
    frames = Track("f", 25.0 * tracks[0].times, tracks[0].points)
    (slow, _) = track_crowd.find_people(walk, walk.gait, WalkQuestion(fps=10.0), [frames]).limits
    assert "all are slower than 0.25 m/s: are times in frames or milliseconds" in slow.text
    assert "'3' at 2.90 s: no sample for 3.1 s, and goes straight to the next one" in told.text
    legs = track_files.read_tracks(jump, TrackReading(split=2.0)).tracks
    assert [(leg.person, len(leg)) for leg in legs] == [("3", 30), ("3~2", 30), ("3~3", 2)]
    with pytest.raises(FileError, match="jumps"):
        track_files.read_tracks(jump)


def test_clocks_that_count_from_1970_give_the_same_people(tmp_path, walk):
    paths = []
    for begin in (0.0, 1_732_800_000.0):
        rows = [f"{begin + k / 12:.4f},{who},{k / 12},{who}\n" for k in range(36) for who in "12"]
        tracks = track_files.read_tracks(write(tmp_path, "a.csv", HEAD + "".join(rows))).tracks
        crowd = track_crowd.find_people(walk, walk.gait, WalkQuestion(fps=30.0), tracks)
        paths.append([person.path for person in crowd.people])
    for path, later in zip(*paths, strict=True):
        assert path.first == later.first and len(path) == len(later) == 88
        np.testing.assert_allclose(later.points, path.points, atol=1e-5)


def test_too_many_people_are_refused(tmp_path):
    people = "".join(f"0,p{index},0,0\n" for index in range(MAX_PEOPLE + 1))
    with pytest.raises(FileError, match=f"more than {MAX_PEOPLE} people"):
        track_files.read_tracks(write(tmp_path, "many.csv", HEAD + people))


def test_people_start_stand_and_turn_along_their_tracks(walk, tmp_path):
    """The pelvis is on the track, standing feet do not move, and no foot is below the floor."""
    corner = [(t, 1.2 * t, 0.0) for t in range(5)] + [(t, 4.8, 0.0) for t in range(5, 8)]
    corner += [(t, 4.8, 1.2 * (t - 7)) for t in range(8, 12)]
    rows = "".join(f"{t},a,{x},{y}\n" for t, x, y in corner)
    late = "".join(f"{t},b,0,{3 + 0.8 * t}\n" for t in range(4, 9))
    tracks = track_files.read_tracks(write(tmp_path, "a.csv", HEAD + rows + late)).tracks
    crowd = track_crowd.build_crowd(walk, walk.gait, WalkQuestion(count=2), tracks)
    assert crowd.frames == 11 * 30 + 1
    np.testing.assert_array_equal(crowd.presence, [[0, 331], [120, 241]])
    bones = {motion.index: motion.world()[0] for motion in bone_motion.character_motions(crowd)}
    for index, track in enumerate(tracks):
        frames = np.round(track.times * 30).astype(int) - crowd.presence[index, 0]
        pelvis = floor_plane.project(bones[index][frames, 0])
        assert np.abs(pelvis - track.points).max() < 0.15
        assert bones[index][..., 1].min() > 0.0
    # Control: the other person is far away.
    assert np.abs(pelvis - tracks[0].points[:5]).max() > 1.0


CORNER = [[0.0, 0.0], [0.0, 3.0], [3.0, 3.0]]


def test_a_route_leads_round_its_corner_and_ends_standing(walk):
    route = Route(np.array(CORNER), 1.1)
    (track,) = route_tracks.tracks_of_routes(walk.gait, [route], 12.0)
    for x, z in CORNER:
        assert np.abs(track.points - complex(z, x)).min() < 0.02
    assert track.times[-1] == 12.0 and (track.points[-120:] == track.points[-1]).all()
    speeds = np.abs(np.diff(track.points) / np.diff(track.times))
    assert speeds[:30] == pytest.approx(1.1, abs=0.02)
    assert speeds[100:240].min() < 1.05 < speeds[240:320].max()


@pytest.mark.parametrize(
    ("waypoints", "speed", "message"),
    [
        ([[0, 0], [0, 5]], 0.3, "paths/1/speed: 0.3 m/s, expected 0.487 to 1.79"),
        ([[0, 0]], 1.0, "paths/1/waypoints: one place, expected a path"),
        ([[0, 0], [0, 1], [0, 1]], 1.0, "paths/1/waypoints/2: 0.000 m from the one before"),
    ],
)
def test_a_route_that_cannot_be_walked_is_refused_by_number(walk, waypoints, speed, message):
    routes = [Route(np.array(CORNER), 1.1), Route(np.array(waypoints, dtype=float), speed)]
    with pytest.raises(InvalidField) as caught:
        route_tracks.tracks_of_routes(walk.gait, routes, 5.0)
    assert message in str(caught.value)


def test_people_that_overlap_are_told(walk):
    meet = [Route(np.array([[0.0, z], [0.0, -z]]), 1.0) for z in (-3.0, 3.0)]
    tracks = route_tracks.tracks_of_routes(walk.gait, meet, 5.0)
    facts = track_crowd.build_crowd(walk, walk.gait, WalkQuestion(count=2), tracks).facts
    seconds = [pytest.approx(2.7, abs=0.15)]
    assert facts["feet_stand"] and "take" not in facts
    assert facts["overlaps"] == {"pairs": 1, "first": ["0"], "second": ["1"], "seconds": seconds}
    (warning,) = [line for line in facts["warnings"] if "nearer than 0.5 m: 1" in line]
    assert "the first at 2." in warning and warning.endswith("s (0 and 1)")
    apart = track_crowd.build_crowd(walk, walk.gait, WalkQuestion(count=2), tracks[:1]).facts
    assert apart["overlaps"]["pairs"] == 0


def test_a_person_has_the_same_bytes_alone_and_in_a_crowd(walk):
    routes = [Route(np.array([[x, 0.0], [x, 3.0], [x + 2.0, 4.0]]), 1.1) for x in range(3)]
    tracks = route_tracks.tracks_of_routes(walk.gait, routes, 4.0)
    short = replace(tracks[1], times=tracks[1].times[:150], points=tracks[1].points[:150])
    crowd = (tracks[0], short, *tracks[1:])
    order = WalkQuestion(count=len(crowd), take="index")
    together = motions_by_person(walk, order, crowd)
    assert len(together) == 3
    for track in (tracks[0], tracks[2]):
        alone = motions_by_person(walk, order, (track,))
        assert alone[track.person] == together[track.person]
    assert together["0"] != together["2"]


def motions_by_person(walk, order, tracks):
    crowd = track_crowd.find_people(walk, walk.gait, order, tracks)
    return {
        person.track.person: (m.rotations[row].tobytes(), m.root_position[row].tobytes())
        for people, _, m in crowd.batches()
        for row, person in enumerate(people)
    }


@pytest.mark.parametrize("rate", [1.0, 1000.0])
def test_slow_and_fast_samples_are_followed(walk, rate):
    times = np.arange(0.0, 6.0 + 1e-9, 1.0 / rate)
    tracks = (Track("a", times, 1.2j * times),)
    crowd = track_crowd.find_people(walk, walk.gait, WalkQuestion(count=1), tracks)
    assert crowd.frames == 181 and crowd.people[0].path.errors.max() < 1e-6


def test_people_who_stop_are_made_at_one_frame_a_second(walk):
    place = np.clip(0.1 * np.arange(200) - 5.0, 0.0, 5.0)
    order, (track, _) = WalkQuestion(fps=1.0), path_of(np.column_stack([place, 0.0 * place]))
    crowd = [replace(track, person=person) for person in "abcdefgh"]
    ((_, plan, _),) = track_crowd.find_people(walk, walk.gait, order, crowd).batches()
    assert (np.count_nonzero(np.diff(plan.phases), axis=1) < 10).all()


def test_people_are_hidden_outside_of_their_tracks(walk, tmp_path):
    late = Track("late", np.array([1.0, 2.0]), np.array([5.0j, 6.0j]))
    whole = Track("whole", np.array([0.0, 3.0]), np.array([0.0j, 3.0j]))
    crowd = track_crowd.build_crowd(walk, walk.gait, WalkQuestion(count=2), (whole, late))
    crowd_writer.write(crowd, tmp_path / "street.usda")
    stage = Usd.Stage.Open(str(tmp_path / "street.usda"))
    characters = stage.GetPrimAtPath("/Crowd/Characters").GetChildren()
    assert [prim.GetDisplayName() for prim in characters] == ["whole", "late"]
    visibilities = [UsdGeom.Imageable(prim).ComputeVisibility for prim in characters]
    seen = [[f for f in range(crowd.frames) if at(f) == "inherited"] for at in visibilities]
    assert seen == [[*range(91)], [*range(30, 61)]]


def test_few_people_of_a_long_clock_are_in_memory_at_once(walk):
    def people(begin):
        return Track(f"from {begin}", begin + np.array([0.0, 1.0]), np.array([0.0j, 1.0j]))

    order = WalkQuestion(count=4)
    tracks = [people(begin) for begin in (0.0, 0.0, 1.0, 300.0)]
    batches = list(track_crowd.build_crowd(walk, walk.gait, order, tracks).batches)
    shapes = [(*batch.rotations.shape[:2], len(batch.feet.skate)) for batch in batches]
    assert shapes == [(1, 9031, 1)] * 4
    (short,) = track_crowd.build_crowd(walk, walk.gait, order, tracks[:3]).batches
    for index, batch in enumerate(batches[:3]):
        assert np.array_equal(batch.rotations[0, :61], short.rotations[index])
        assert np.array_equal(batch.bone_offsets[0], short.bone_offsets[index])
    with pytest.raises(InvalidField, match="27000000031 frames from the first sample"):
        track_crowd.find_people(walk, walk.gait, order, [tracks[0], people(9e8)])


def path_of(points):
    track = Track("a", 0.1 * np.arange(len(points)), floor_points(*points.T))
    return track, track_path.follow(track, 0.0, 60.0)


def test_a_corner_at_constant_speed_is_cut_by_a_hand_s_breadth_and_the_time_is_kept():
    gone = 1.3 * 0.1 * np.arange(60) - 4.0
    _, path = path_of(np.column_stack([np.minimum(gone, 0.0), np.maximum(gone, 0.0)]))
    assert path.errors.max() < 0.08
    # The negative control: averaged over longer, as what no walker does.
    longer = floor_plane.smooth(path.points, track_path.LONG_WINDOW * 60.0)
    assert np.abs(longer - path.points).max() > 0.2


def test_legs_pass_beside_each_other_in_a_corner(walk):
    angles = np.clip((0.11 * np.arange(60) - 3.0) / 0.6, 0.0, np.pi / 2)
    track, _ = path_of(np.cumsum(0.11 * np.column_stack([np.cos(angles), np.sin(angles)]), axis=0))
    crowd = track_crowd.build_crowd(walk, walk.gait, WalkQuestion(count=1), [track])
    ((joints, _),) = (motion.world() for motion in bone_motion.character_motions(crowd))
    names = [side + end for end in ("Leg", "Foot") for side in ("Left", "Right")]
    legs = joints[:, [crowd.skeleton.names.index(name) for name in names]]
    shins = np.linspace(legs[:, :2], legs[:, 2:], 8)
    assert np.linalg.norm(shins[:, None, :, 0] - shins[:, :, 1], axis=-1).min() > 0.06


def test_who_pauses_turns_no_faster_than_on_the_spot():
    east = np.concatenate([0.11 * np.arange(40), np.full(20, 4.29), 4.29 - 0.11 * np.arange(40)])
    _, path = path_of(np.column_stack([east, 0.0 * east]))
    assert 60.0 * np.abs(np.diff(path.headings)).max() < 1.7 * np.pi / step_plan.turn_seconds(np.pi)


def test_who_creeps_steps_and_who_trembles_does_not_tramp(walk):
    still = np.zeros((200, 2))
    noise = np.random.default_rng(0).normal(0.0, 0.03, still.shape)
    east = still + np.linspace(0.0, 0.4, 200)[:, None] * (1.0, 0.0)
    for points, least, most in ((still, 0.0, 0.0), (noise, 0.0, 3.0), (east, 1.0, 6.0)):
        order, (track, _) = WalkQuestion(count=1), path_of(points)
        ((_, plan, motions),) = track_crowd.find_people(walk, walk.gait, order, [track]).batches()
        assert least <= np.ptp(np.unwrap(plan.phases[0], period=1.0)) <= most
        assert motions.feet.skate[0] < 0.01
        # Also who stands is alive.
        head = motions.rotations[0, :, walk.session.card.skeleton.names.index("Head")]
        assert np.ptp(head, axis=0).max() > 0.005
    assert path_of(east)[1].headings == pytest.approx(np.pi / 2, abs=0.02)
