"""Files of crowds besides USD: bones as OSI, Arrow, NPZ, for CARLA and for Gazebo."""

import struct
from xml.etree import ElementTree

import numpy as np
import pyarrow as pa
import pytest
from osi3.osi_groundtruth_pb2 import GroundTruth
from osi_utilities import MessageType
from osi_utilities.tracefile.readers.single import SingleTraceReader

import posefield
from posefield.common.errors import InvalidField, UnknownFormat
from posefield.encode import bone_motion, bone_tables, crowd_formats, osi_trace
from posefield.motion import quat
from posefield.question.walk_question import WalkQuestion
from posefield.tracks import track, track_crowd

FPS = 30.0
PEOPLE = {
    "turning": (np.arange(0.0, 6.0, 0.2), 0.9),
    "later": (np.arange(1.5, 4.0, 0.2), 1.3),
}


@pytest.fixture(scope="module")
def model():
    return posefield.load("cmu_walk").synthesizer


@pytest.fixture(scope="module")
def crowd(model):
    """Two people on arcs, one of whom is there for a part of the time."""
    tracks = []
    for person, (times, speed) in PEOPLE.items():
        turns = speed * times / 5.0
        points = track.floor_points(5.0 * np.sin(turns), -5.0 * np.cos(turns))
        tracks.append(track.Track(person, 10.0 + times, points))
    question = WalkQuestion(count=2, seconds=1.0, fps=FPS)
    return lambda: track_crowd.build_crowd(model, model.gait, question, tracks)


def save(crowd, model, path, **question):
    crowd_formats.write(crowd, path, WalkQuestion(**question), model.session.card.roles)
    return path


@pytest.fixture(scope="module")
def trace(crowd, model, tmp_path_factory):
    return save(crowd(), model, tmp_path_factory.mktemp("osi") / "a_gt_b.osi")


def read_trace(path):
    reader = SingleTraceReader()
    reader.set_message_type(MessageType.GROUND_TRUTH)
    assert reader.open(path)
    with reader:
        return [result.message for result in reader]


def vector(message):
    return np.array([message.x, message.y, message.z])


def rotation(message):
    return quat.from_euler(np.array([message.yaw, message.pitch, message.roll]), "ZYX")


def skeleton_of(thing):
    """World positions of the bones of a person as a reader of OSI chains them, by type."""
    parents = {kind: parent for _, kind, parent in osi_trace.BONES}
    kinds = {role: kind for role, kind, _ in osi_trace.BONES} | {"root": 0}
    turn = rotation(thing.base.orientation)
    offset = quat.rotate(turn, vector(thing.pedestrian_attributes.bbcenter_to_root))
    placed = {}
    for bone in thing.pedestrian_attributes.skeleton_bone:
        place, above = vector(thing.base.position) + offset, turn
        if bone.type:
            place, above = placed[kinds[parents[bone.type]]]
        placed[bone.type] = (
            place + quat.rotate(above, vector(bone.position)),
            quat.mul(above, rotation(bone.orientation)),
        )
    return placed


def test_messages_are_those_of_the_libraries_of_osi(trace):
    content, frames = trace.read_bytes(), 0
    while content:
        (size,) = struct.unpack("<I", content[:4])
        message = content[4 : 4 + size]
        assert GroundTruth.FromString(message).SerializeToString() == message
        content, frames = content[4 + size :], frames + 1
    messages = read_trace(trace)
    assert len(messages) == frames
    stamps = [message.timestamp.seconds + 1e-9 * message.timestamp.nanos for message in messages]
    np.testing.assert_allclose(stamps, 10.0 + np.arange(frames) / FPS, atol=1e-9)
    counts = [len(message.moving_object) for message in messages]
    assert set(counts) == {1, 2}
    assert counts[round(1.5 * FPS)] == 2
    names = {one.source_reference[0].identifier[0] for one in messages[60].moving_object}
    assert names == set(PEOPLE)


def test_bones_of_a_trace_are_those_of_the_crowd_in_the_world(trace, crowd, model):
    messages, card = read_trace(trace), model.session.card
    for motion, person in zip(bone_motion.character_motions(crowd()), PEOPLE, strict=True):
        positions, _ = motion.world()
        for frame in range(0, len(motion), 9):
            things = messages[motion.first + frame].moving_object
            thing = next(one for one in things if one.source_reference[0].identifier == [person])
            placed = skeleton_of(thing)
            for role, kind, _ in osi_trace.BONES:
                x, y, z = positions[frame, card.skeleton.names.index(card.roles[role])]
                np.testing.assert_allclose(placed[kind][0], [x, -z, y], atol=3e-6)
            # A walker's box has its heels and its head in it, and faces the way that it goes.
            top = thing.base.position.z + 0.5 * thing.base.dimension.height
            assert placed[5][0][2] < top < placed[5][0][2] + 0.4
            ahead = quat.rotate(rotation(thing.base.orientation), np.array([1.0, 0.0, 0.0]))
            assert vector(thing.base.velocity) @ ahead > 0.5


def test_velocities_of_a_trace_are_central_differences(trace):
    walker = [message.moving_object[0] for message in read_trace(trace)]
    bones = [one.pedestrian_attributes.skeleton_bone for one in walker]
    for frames in [[one.base] for one in walker], bones:
        positions = np.array([[vector(part.position) for part in parts] for parts in frames])
        speeds = np.array([[vector(part.velocity) for part in parts] for parts in frames])
        differences = 0.5 * FPS * (positions[2:] - positions[:-2])
        np.testing.assert_allclose(speeds[1:-1], differences, atol=1e-9)
    turns = np.array([[rotation(bone.orientation) for bone in parts] for parts in bones])
    rates = np.array([[spin_of(bone) for bone in parts] for parts in bones])
    steps = 0.5 * FPS * quat.log(quat.mul(turns[2:], quat.conj(turns[:-2])))
    np.testing.assert_allclose(rates[1:-1], steps, atol=3e-5)
    # The rates of a neighbouring frame are others: the tolerance tells them apart.
    assert np.abs(rates[:-2] - steps).max() > 0.1


def spin_of(part):
    rate = part.orientation_rate
    return np.array([rate.roll, rate.pitch, rate.yaw])


def test_feet_in_the_world_move_as_chained_rates_of_bones_say(trace):
    """Velocities of chained bones, as a radar computes them, agree with differences to 1 %."""
    walker = [message.moving_object[0] for message in read_trace(trace)]
    feet = np.array([skeleton_of(one)[18][0] for one in walker])
    speeds = np.array([velocity_of(one, 18) for one in walker])[1:-1]
    differences = 0.5 * FPS * (feet[2:] - feet[:-2])
    error = np.linalg.norm(speeds - differences, axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.01 * np.sqrt(np.mean(np.sum(differences**2, axis=1)))


def velocity_of(thing, kind):
    parents = {kind: parent for _, kind, parent in osi_trace.BONES}
    kinds = {role: kind for role, kind, _ in osi_trace.BONES} | {"root": 0}
    bones = {bone.type: bone for bone in thing.pedestrian_attributes.skeleton_bone}
    placed = skeleton_of(thing) | {
        -1: (vector(thing.base.position), rotation(thing.base.orientation))
    }
    chain = [kind]
    while chain[-1]:
        chain.append(kinds[parents[chain[-1]]])
    spin = spin_of(thing.base)
    velocity, before = vector(thing.base.velocity), -1
    for bone in reversed(chain):
        place, above = placed[before]
        velocity = velocity + quat.rotate(above, vector(bones[bone].velocity))
        velocity += np.cross(spin, placed[bone][0] - place)
        spin = spin + quat.rotate(above, spin_of(bones[bone]))
        before = bone
    return velocity


def test_tables_have_a_row_for_each_person_and_frame(crowd, model, tmp_path):
    rows = pa.ipc.open_stream(save(crowd(), model, tmp_path / "a.arrow").read_bytes()).read_all()
    with np.load(save(crowd(), model, tmp_path / "a.bones.npz")) as arrays:
        assert arrays["people"].tolist() == list(PEOPLE)
        for name in rows.schema.names:
            column = rows[name].combine_chunks()
            values = (
                column.to_numpy_ndarray()
                if isinstance(column, pa.FixedShapeTensorArray)
                else column.to_numpy()
            )
            np.testing.assert_array_equal(values, arrays[name])
        person, time, places = (arrays[name] for name in ("person", "time", "positions"))
        for motion in bone_motion.character_motions(crowd()):
            rows_of = person == motion.index
            np.testing.assert_allclose(places[rows_of], motion.world()[0], atol=1e-6)
            assert time[rows_of][0] == pytest.approx(10.0 + motion.first / FPS)
            speeds = arrays["velocities"][rows_of]
            differences = 0.5 * FPS * (places[rows_of][2:] - places[rows_of][:-2])
            np.testing.assert_allclose(speeds[1:-1], differences, atol=1e-4)


def test_a_table_for_carla_is_the_crowd_in_its_left_handed_axes(crowd, model, tmp_path):
    roles, names = model.session.card.roles, model.session.card.skeleton.names
    with np.load(save(crowd(), model, tmp_path / "a.carla.npz")) as arrays:
        assert arrays["names"].tolist() == list(bone_tables.CARLA_BONES)
        motion = next(bone_motion.character_motions(crowd()))
        rows_of, yaw = arrays["person"] == 0, arrays["yaw"]
        cos, sin = np.cos(yaw[rows_of])[:, None], np.sin(yaw[rows_of])[:, None]
        x, y, z = np.moveaxis(arrays["bones"][rows_of], -1, 0)
        # Yaw turns x to y; the world's y is south, so that east, south and up are left-handed.
        placed = np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)
        placed += arrays["location"][rows_of][:, None]
        joints = [names.index(roles[role]) for role in bone_tables.CARLA_BONES.values()]
        expected = motion.world()[0][:, joints][..., [0, 2, 1]]
        np.testing.assert_allclose(placed, expected, atol=1e-5)
        right = arrays["names"].tolist().index("crl_thigh__R")
        assert (arrays["bones"][:, right, 1] > 0.0).all()


def test_actors_of_gazebo_wait_until_they_appear(crowd, model, tmp_path):
    world = ElementTree.parse(save(crowd(), model, tmp_path / "street.sdf")).getroot()
    actors = world.findall("./world/actor")
    assert [actor.get("name") for actor in actors] == list(PEOPLE)
    assert [float(actor.findtext("./script/delay_start")) for actor in actors] == [0.0, 1.5]
    for actor, motion in zip(actors, bone_motion.character_motions(crowd()), strict=True):
        text = (tmp_path / actor.findtext("./animation/filename")).read_text()
        assert f"Frames: {len(motion)}\n" in text
        first = text.partition("Frame Time")[2].splitlines()[1].split()[:3]
        np.testing.assert_allclose(np.array(first, float), motion.roots[0], atol=1e-4)


def test_bad_endings_bodies_and_skeletons_are_refused(crowd, model, tmp_path):
    with pytest.raises(UnknownFormat, match=r"a\.fbx"):
        save(crowd(), model, tmp_path / "a.fbx")
    with pytest.raises(InvalidField, match="osi files carry no body"):
        crowd_formats.endings_of([tmp_path / "a.osi"], WalkQuestion(body="bones"))
    both = tmp_path / "a.osi", tmp_path / "a.usd"
    assert crowd_formats.endings_of(both, WalkQuestion(body="bones")) == ("osi", "usd")
    roles = dict(model.session.card.roles)
    del roles["leftHand"]
    for name in ("a.osi", "a.carla.npz"):
        with pytest.raises(InvalidField, match="leftHand"):
            crowd_formats.write(crowd(), tmp_path / name, WalkQuestion(), roles)
    assert not list(tmp_path.iterdir())
