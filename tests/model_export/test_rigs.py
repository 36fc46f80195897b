"""Tests of the normalization of skeletons: each fault is a sentence that names what was found."""

import re
from dataclasses import replace

import numpy as np
import pytest
from minimal import recipe_with, write_clips

from posefield.common.errors import RecipeError
from posefield.common.units import UP
from posefield.motion import quat
from posefield.motion.clip import Clip, assemble
from posefield.motion.skeleton import Skeleton
from posefield_train.source import facing, ingest, skeleton_checks

# A file keeps a millionth of a degree and of a metre.
WRITTEN = 1e-5
BODY = Skeleton(
    ("Hips", "Spine", "Head", "LeftUpLeg", "LeftLeg", "RightUpLeg", "RightLeg"),
    (-1, 0, 1, 0, 3, 0, 5),
    np.array(
        [(0, 0, 0), (0, 0.4, 0), (0, 0.3, 0)]
        + [row for s in (1, -1) for row in ((s * 0.1, 0, 0), (0, -0.45, 0.02))],
        dtype=float,
    ),
    (2,),
    np.array([(0, 0.2, 0)]),
)


def walker(phase=0.0, frames=21, sideways=0.0, body=BODY):
    """A body that faces +z, swings its joints, and travels 1.5 m; `sideways` turns its way, rad."""
    t = np.linspace(0.0, 1.0, frames)
    swing = 0.2 * np.sin(5 * t[:, None, None] + phase + np.arange(3 * len(body)).reshape(-1, 3))
    path = 1.5 * np.outer(t, [np.sin(sideways), 0.0, np.cos(sideways)]) + 0.9 * UP
    rotations = quat.exp(swing)
    rotations[:, 0] = quat.exp(0.2 * swing[:, 0])
    return assemble(body, rotations, path, body.offsets, 30.0)


def family(**options):
    return [walker(phase, **options) for phase in (0.0, 0.4, 0.8)]


def below(clip, rotations, path, name="Reference", siblings=0):
    """The clip below a further root with rotations (F, 4) and a path (F, 3), m, that moves alone:
    the clip's joints stay where they are in the world."""
    own = clip.skeleton
    extra = tuple(f"Target{n}" for n in range(siblings))
    joints = Skeleton(
        (name, *own.names, *extra),
        (-1, 0, *(parent + 1 for parent in own.parents[1:]), *(0 for _ in extra)),
        np.vstack([np.zeros(3), own.offsets, *(np.ones(3) for _ in extra)]),
        tuple(joint + 1 for joint in own.tip_joints),
        own.tip_offsets,
    )
    back = quat.conj(rotations)
    inner = quat.rotate(back, clip.root_path - path)
    turned = quat.mul(back, clip.rotations[:, 0])
    frames = len(clip)
    rest = np.tile(quat.IDENTITY, (frames, len(extra), 1))
    return Clip(
        joints,
        np.concatenate([rotations[:, None], turned[:, None], clip.rotations[:, 1:], rest], axis=1),
        np.concatenate(
            [
                path[:, None],
                inner[:, None],
                clip.translations[:, 1:],
                np.ones((frames, siblings, 3)),
            ],
            axis=1,
        ),
        clip.rate,
    )


def standing_root(clip, height=0.0):
    frames = len(clip)
    return np.tile(quat.IDENTITY, (frames, 1)), np.tile([0.3, height, -2.0], (frames, 1))


@pytest.fixture
def read(tmp_path):
    """Function that writes clips and reads them by a recipe with some keys of [motion]."""

    def of(clips, performers=None, **motion):
        folder = write_clips(tmp_path / "data", clips)
        clip_columns = {}
        if performers:
            rows = [f"{i}.bvh,{i},{who}" for i, who in enumerate(performers)]
            (folder / "clips.csv").write_text("\n".join(["file,v,who", *rows]) + "\n")
            clip_columns = {"clips": {"performer": "who"}}
        return ingest.ingest(recipe_with(motion=motion, **clip_columns), folder)

    return of


def refusal(read, clips, *args, **motion):
    with pytest.raises(RecipeError) as caught:
        read(clips, *args, **motion)
    return str(caught.value)


# --- dummy roots


def test_a_static_root_above_the_pelvis_is_collapsed_with_a_note(read):
    plain, none = read(family())
    clips = [below(clip, *standing_root(clip, 0.7)) for clip in family()]
    found, notes = read(clips)
    assert none == []
    assert notes == [
        "'Reference' is a dummy root above 'Hips', which moves on its own and became the root"
    ]
    for one, other in zip(plain, found, strict=True):
        assert other.clip.skeleton.names == BODY.names
        assert np.abs(one.clip.positions() - other.clip.positions()).max() < WRITTEN
    moved = found[0].clip.root_path
    assert np.ptp(moved, axis=0).max() > 1.0


def test_a_root_that_slides_over_the_floor_is_collapsed_too(read):
    slid = []
    for clip in family():
        turn = quat.from_axis_angle(UP, np.linspace(0.0, 0.4, len(clip)))
        slid.append(below(clip, turn, clip.root_path * (1.0 - UP)))
    bouncing = [replace(clip, translations=clip.translations + 0.0) for clip in slid]
    for clip in bouncing:
        clip.translations[:, 1, 1] += 0.05 * np.sin(np.linspace(0, 6, len(clip)))
    found, notes = read(bouncing)
    assert len(notes) == 1 and found[0].clip.skeleton.names == BODY.names
    wanted = bouncing[0].positions()[:, 2] - bouncing[0].positions()[:, 1]
    got = found[0].clip.positions()[:, 1] - found[0].clip.positions()[:, 0]
    assert np.abs(np.linalg.norm(wanted, axis=1) - np.linalg.norm(got, axis=1)).max() < WRITTEN


def test_a_root_that_moves_with_its_body_is_kept():
    clip = walker()
    tumbling = quat.exp(np.linspace(0, 1, len(clip))[:, None] * np.array([0.5, 0.2, 0.1]))
    held = below(clip, tumbling, clip.root_path + 0.1)
    assert skeleton_checks.count_dummies([held]) == 0
    assert skeleton_checks.count_dummies([below(clip, *standing_root(clip))]) == 1
    # A static root whose only child turns in place is a joint: the base of an arm.
    fixed = replace(clip, translations=np.broadcast_to(clip.translations[:1], (21, 7, 3)))
    assert skeleton_checks.count_dummies([below(fixed, *standing_root(fixed))]) == 0


def test_a_dummy_root_that_the_recipe_names_is_refused(read):
    clips = [below(clip, *standing_root(clip)) for clip in family()]
    said = refusal(read, clips, joint_weights={"Reference": 2.0})
    assert "the recipe names 'Reference', but 'Reference' is a dummy root" in said
    assert said.endswith("name 'Hips' instead")


# --- bones that stretch


def stretched(joint, much, frames=slice(None)):
    clips = family()
    for clip in clips[1:2]:
        swing = np.zeros(len(clip))
        swing[frames] = np.sin(np.linspace(0, 6, len(clip)))[frames]
        clip.translations[:, joint, 1] += (much * swing).reshape(-1, *np.ndim(joint) * [1])
    return clips


def test_bones_that_stretch_by_centimetres_are_refused_unless_the_recipe_says_so(read):
    said = refusal(read, stretched(2, 0.05))
    found = re.search(r"joint 'Head' moves by up to ([\d.]+) cm against its parent 'Spine'", said)
    assert 4.0 < float(found[1]) < 5.5
    assert "1.bvh" in said and re.search(r"expected at most 0\.[67]", said)
    assert said.endswith("or say motion.bones = 'stretch' to keep the mean")
    _, notes = read(stretched(2, 0.05), bones="stretch")
    assert "bones stretch by up to" in notes[0] and notes[0].endswith("their mean is kept")


@pytest.mark.parametrize(
    ("clips", "cause"),
    [
        (lambda: stretched(2, 0.5, slice(10, 11)), "in few frames, as after a marker was lost"),
        (
            lambda: stretched([1, 2, 3, 4, 5, 6], 0.05),
            "most bones do, as in a solve without a fixed",
        ),
        (
            lambda: [below(clip, *standing_root(clip), siblings=2) for clip in family()],
            "looks like the body's own root besides Target0, Target1: leave the others out",
        ),
    ],
)
def test_the_likely_cause_is_told(read, clips, cause):
    assert cause in refusal(read, clips())


# --- bodies and rest poses


def test_two_performers_under_one_name_are_a_sentence(read):
    tall = replace(BODY, offsets=1.15 * BODY.offsets)
    clips = [*family(), *family(body=tall)]
    said = refusal(read, clips, ["ann"] * 6)
    assert (
        "two performers under the name 'ann': the bones of 3 clips, such as 3.bvh, differ by"
        in said
    )
    assert said.endswith("from those of 3, such as 0.bvh; expected one body for each name")
    assert len(read(clips, ["ann"] * 3 + ["ben"] * 3)[0]) == 6
    # One clip is an outlier, not a second body.
    assert len(read(clips[:4], ["ann"] * 4)[0]) == 4


def test_a_rest_pose_in_one_point_is_a_sentence(read):
    point = replace(BODY, offsets=np.zeros_like(BODY.offsets))
    said = refusal(read, family(body=point))
    assert "the rest pose is degenerate: all 7 joints lie in one point" in said
    assert not skeleton_checks.is_degenerate(np.zeros((1, 3)))


# --- facing


def based(clip, degrees):
    """The clip in a basis in which its body faces `degrees` to the left of +z."""
    return facing.turn_basis(clip, -degrees)


@pytest.mark.parametrize(("axis", "degrees"), facing.AXES.items())
def test_the_basis_of_the_files_does_not_matter(read, axis, degrees):
    """The examples are those of files that face +z, whatever axis theirs face, if it is told."""
    plain, _ = read(family())
    for asked in (axis, "hips", "travel"):
        found, _ = read([based(clip, degrees) for clip in family()], facing=asked)
        for one, other in zip(plain, found, strict=True):
            assert np.abs(one.clip.positions() - other.clip.positions()).max() < WRITTEN
            assert np.abs(one.offsets - other.offsets).max() < WRITTEN
        assert other.facing == degrees


def test_a_facing_that_contradicts_hips_or_travel_is_refused_with_the_evidence(read):
    said = refusal(read, [based(clip, -90.0) for clip in family()])
    assert "motion.facing: stated as +z, the default, but the line from 'RightUpLeg' to" in said
    assert re.search(r"9\d degrees to the right of the root's \+z in 3 of 3 clips", said)
    assert said.endswith("say motion.facing = '-x'")
    crab = family(sideways=np.pi / 2)
    said = refusal(read, crab, facing="+z")
    assert re.search(r"the clips travel 1.50 m \(mean\) \d\d degrees to the left", said)
    assert said.endswith(
        "say motion.facing = '+x', or 'hips' for a body that moves sideways or backwards"
    )
    _, notes = read(crab, facing="hips")
    assert re.fullmatch(
        r"the clips travel 1.50 m \(mean\) \d\d degrees to the left of the facing", notes[1]
    )
    assert "faces" in refusal(read, crab, facing="travel")


def test_clips_that_face_otherwise_than_the_family_are_named(read):
    clips = family()
    clips[2] = based(clips[2], 180.0)
    said = refusal(read, clips)
    assert "2.bvh" in said and "but in 1 of 3 clips, such as this, 1" in said
    assert said.endswith("files of one family have to face alike")


def test_a_body_without_sides_is_measured_by_its_travel_alone(read):
    names = tuple("abcdefg")
    plain = [replace(clip, skeleton=replace(BODY, names=names)) for clip in family()]
    turned = [based(clip, 180.0) for clip in plain]
    assert "the clips travel 1.50 m" in refusal(read, turned)
    assert read(turned, facing="-z")[0][0].facing == 180.0
    for asked in ("hips", "roles"):
        assert "but no evidence; expected two joints" in refusal(read, turned, facing=asked)


def test_a_family_without_a_facing_keeps_the_axes_of_its_files(read):
    clips = [based(clip, 90.0) for clip in family()]
    found, notes = read(clips, facing="none")
    assert found[0].facing is None and notes == []
    wanted = clips[0].positions() - clips[0].root_path[0] * (1.0 - UP)
    assert np.abs(found[0].clip.positions() - wanted).max() < WRITTEN
