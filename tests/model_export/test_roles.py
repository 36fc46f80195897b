"""Tests of roles: naming conventions, confidence, and the shape of the body."""

import pytest
import skeleton_tables
from families import quadruped_walk

from posefield.motion.joint_roles import ROLES
from posefield.roles import joint_recognition
from posefield_train.sample import noise_free

DEVELOPMENT = skeleton_tables.read("development")
HELD_OUT = {
    name: skeleton
    for table in ("held_out", "held_out_later", "held_out_last")
    for name, skeleton in skeleton_tables.read(table).items()
}
POINT = {"stature": 1.75, "hip_height": 0.94, "turn": 10.0, "target_height": 1.1}


def found(skeleton):
    return joint_recognition.roles_of(skeleton.names, skeleton.parents)


@pytest.mark.parametrize("convention", [*DEVELOPMENT, *HELD_OUT])
def test_no_joint_has_a_wrong_role_without_being_asked(convention):
    skeleton = (DEVELOPMENT | HELD_OUT)[convention]
    assert skeleton.count(found(skeleton))[1] == []
    assert set(skeleton.expected.values()) <= {*ROLES, "?"}


@pytest.mark.parametrize("convention", DEVELOPMENT)
def test_the_conventions_of_development_are_known_whole(convention):
    skeleton = DEVELOPMENT[convention]
    assert skeleton.count(found(skeleton))[2] == []


def test_the_roles_of_other_conventions_are_known():
    right = missing = 0
    for skeleton in HELD_OUT.values():
        own, _, lacking = skeleton.count(found(skeleton))
        right, missing = right + own, missing + len(lacking)
    assert (len(HELD_OUT), right + missing) == (33, 686)
    assert right >= 0.95 * 686


@pytest.mark.parametrize("convention", [*[*DEVELOPMENT][:2], *[*HELD_OUT][:2]])
def test_the_order_of_siblings_changes_nothing(convention):
    skeleton = (DEVELOPMENT | HELD_OUT)[convention]
    order = reversed_siblings(skeleton.parents)
    names = [skeleton.names[joint] for joint in order]
    parents = [order.index(p) if (p := skeleton.parents[joint]) >= 0 else -1 for joint in order]
    assert joint_recognition.roles_of(names, parents) == found(skeleton)


def reversed_siblings(parents):
    """The joints, parents first, with the children of each in reverse."""
    order, waiting = [], [0]
    while waiting:
        order.append(waiting.pop())
        waiting += [joint for joint, parent in enumerate(parents) if parent == order[-1]]
    return order


def test_two_joints_that_fit_equally_are_asked():
    names = ["root", "hips", *(f"left{n}" for n in ("UpLeg", "Leg", "Foot", "Toe1", "Toe2"))]
    names += [f"right{n}" for n in ("UpLeg", "Leg", "Foot", "Toe1")]
    guesses = joint_recognition.recognise(names, [-1, 0, 1, 2, 3, 4, 4, 1, 7, 8, 9])
    assert guesses["leftToes"].confidence == pytest.approx(0.6)
    assert guesses["leftToes"].reasons and not guesses["leftToes"].is_sure
    assert guesses["rightToes"].is_sure and guesses["leftFoot"].is_sure


def test_a_joint_on_one_side_only_is_asked():
    names = ["hips", "leftUpLeg", "leftLeg", "leftFoot"]
    guesses = joint_recognition.recognise(names, [-1, 0, 1, 2])
    assert guesses["leftFoot"].reasons == ("the right side has no such joint",)
    assert joint_recognition.roles_of(names, [-1, 0, 1, 2]).keys() == {"hips"}


def test_names_without_a_meaning_have_no_role():
    assert joint_recognition.roles_of(["a", "lever", "rail"], [-1, 0, 0]) == {}
    assert joint_recognition.recognise(["left"], [-1]) == {}


@pytest.fixture(scope="module")
def standing():
    """Names, guesses and positions of the procedural body that reaches."""
    clip = noise_free.truth_clip(POINT, 30.0)
    own = clip.skeleton
    return own.names, joint_recognition.recognise(own.names, own.parents), clip.positions()


def test_a_body_that_stands_keeps_its_roles(standing):
    names, guesses, positions = standing
    assert len(guesses) >= 20
    assert joint_recognition.check_shape(guesses, names, positions) == guesses
    # The axes of the file do not matter.
    assert joint_recognition.check_shape(guesses, names, positions[..., [2, 0, 1]]) == guesses


def test_mirrored_sides_are_asked(standing):
    names, guesses, positions = standing
    checked = joint_recognition.check_shape(guesses, names, positions * [-1.0, 1.0, 1.0])
    unsure = {role for role, guess in checked.items() if not guess.is_sure}
    assert unsure == {role for role in guesses if role.startswith(("left", "right"))}


def test_bones_of_different_lengths_are_asked(standing):
    names, guesses, positions = standing
    longer = positions.copy()
    hand, elbow = (names.index(guesses[role].joint) for role in ("leftHand", "leftLowerArm"))
    longer[:, hand] += 0.25 * (positions[:, hand] - positions[:, elbow])
    checked = joint_recognition.check_shape(guesses, names, longer)
    unsure = {role for role, guess in checked.items() if not guess.is_sure}
    assert unsure == {"leftHand", "rightHand"}
    assert "units long, left and right" in checked["leftHand"].reasons[0]


def human_name(name):
    """The name of a quadruped's joint as animal files of human tools have it."""
    trunk = {"pelvis": "Hips", "spine": "Spine", "chest": "Spine1", "neck": "Neck", "head": "Head"}
    limbs = {
        "fore": {"upper": "Arm", "lower": "ForeArm", "paw": "Hand"},
        "hind": {"upper": "UpLeg", "lower": "Leg", "paw": "Foot"},
    }
    if name in trunk or name.startswith("tail"):
        return trunk.get(name, name)
    limb, side, part = name.split("_")
    return ("Left" if side == "a" else "Right") + limbs[limb][part]


def test_a_quadruped_with_human_names_is_asked():
    clip = quadruped_walk.walk_stride("fox", 0.8, 0.3)
    own = clip.skeleton
    names = tuple(human_name(name) for name in own.names)
    guesses = joint_recognition.recognise(names, own.parents)
    assert len(joint_recognition.sure_roles(guesses)) > 10
    checked = joint_recognition.check_shape(guesses, names, clip.positions())
    assert joint_recognition.sure_roles(checked) == {}
    assert "as a quadruped's" in checked["hips"].reasons[-1]
