"""Tests of reading UsdSkel: stages of other tools, sparse samples, value clips, and refusals."""

import numpy as np
import pytest
import usd_files
from pxr import Sdf, Usd, UsdSkel

from posefield.common.errors import FileError, MotionFileError
from posefield.motion import quat
from posefield.motion.skeleton import positions
from posefield_train.source import motion_readers
from posefield_train.source.motion_file import ReadOptions

FRAMES = 13
CODES = np.arange(FRAMES)
X, Y, Z = np.eye(3)
HALF = np.sqrt(0.5)


def swing(axis=Z):
    """Rotations (F, 2, 4): the first joint swings about an axis, the second is still."""
    own = quat.from_axis_angle(axis, 1.2 * np.sin(0.3 * CODES))
    return np.stack([own, np.tile(quat.IDENTITY, (FRAMES, 1))], axis=1)


def hand(axis=Z, bone=Y):
    return quat.rotate(swing(axis)[:, 0], np.broadcast_to(bone, (FRAMES, 3)))


def places(file):
    return positions(file.skeleton.parents, file.rotations, file.translations)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.usda"


def read(path, **options):
    return motion_readers.read(path, ReadOptions(**options))


def saved(made):
    made.GetRootLayer().Save()
    return made


@pytest.fixture
def swinging(path):
    """Function that writes a stage of a swinging arm, changed by a function, and reads it."""

    def of(change=lambda made: None, *, options=None, **facts):
        made = usd_files.stage(path, **facts)
        usd_files.animation(made, "/Root/Anim", CODES, swing())
        change(made)
        saved(made)
        return read(path, **(options or {}))

    return of


def test_an_animated_arm_is_read_with_what_the_stage_states(swinging):
    found = swinging(unit=0.01, up="Z", codes=24.0)
    assert (found.format, found.rate, found.metres_per_unit, found.up) == ("USD", 24.0, 0.01, "z")
    assert found.skeleton.names == ("upper", "lower") and found.skeleton.parents == (-1, 0)
    assert np.abs(places(found)[:, 1] - hand()).max() < 1e-6
    assert np.abs(places(found)[:, 1] - Y).max() > 0.1


def test_a_stage_that_states_nothing_leaves_unit_and_axis_to_the_recipe(swinging):
    found = swinging(unit=None, up=None, codes=None)
    assert (found.metres_per_unit, found.up, found.rate) == (None, None, 24.0)
    assert "states no timeCodesPerSecond, 24 is USD's default" in found.notes[0]


def test_joints_in_another_order_and_joints_left_out_are_matched_by_name(path):
    made = usd_files.stage(path)
    turns = swing()[:, ::-1]
    still = np.tile([(0, 1, 0), (0, 0, 0)], (FRAMES, 1, 1))
    usd_files.animation(
        made, "/Root/Anim", CODES, turns, joints=["upper/lower", "upper"], places=still
    )
    saved(made)
    assert np.abs(places(read(path))[:, 1] - hand()).max() < 1e-6
    made.RemovePrim("/Root/Anim")
    usd_files.animation(
        made, "/Root/Anim", CODES, swing()[:, :1], joints=["upper"], places=np.zeros((FRAMES, 1, 3))
    )
    saved(made)
    assert np.abs(places(read(path))[:, 1] - hand()).max() < 1e-6


def test_transforms_above_the_skeleton_count(swinging):
    """Centimetres with z up below a node that is turned, scaled and moves over time."""

    def change(made):
        turn = (HALF, -HALF, 0, 0)
        usd_files.transform(made, "/Root", usd_files.matrix(turn, (3, 0, 0), 0.01))

    found = swinging(change)
    turned = 0.01 * hand()[:, [0, 2, 1]] * [1, 1, -1] + [3, 0, 0]
    assert np.abs(places(found)[:, 1] - turned).max() < 1e-6

    def moving(made):
        for code in CODES.tolist():
            usd_files.transform(made, "/Root", usd_files.matrix(place=(0.1 * code, 0, 0)), code)

    walked = swinging(moving)
    assert np.abs(places(walked)[:, 1] - hand() - 0.1 * np.outer(CODES, X)).max() < 1e-6


def test_the_bind_pose_becomes_the_rest_pose_with_identity_rotations(path):
    """A bone along its own y whose joint is turned: the bone points along x."""
    turn = (HALF, 0, 0, -HALF)
    rest = [usd_files.matrix(turn), usd_files.matrix(place=(0, 1, 0))]
    bind = [usd_files.matrix(turn), usd_files.matrix(turn, (1, 0, 0))]
    made = usd_files.stage(path)
    usd_files.skeleton(made, "/Root/Skel", rest=rest, bind=bind)
    still = np.tile([turn, (1, 0, 0, 0)], (FRAMES, 1, 1))
    usd_files.animation(made, "/Root/Anim", CODES, still)
    saved(made)
    found = read(path)
    assert np.abs(found.skeleton.offsets[1] - X).max() < 1e-6
    assert np.abs(found.rotations - quat.IDENTITY).max() < 1e-6


def test_sparse_samples_need_a_rate_at_which_they_are_sampled(path):
    made = usd_files.stage(path)
    ends = np.stack([np.tile(quat.IDENTITY, (3, 1)), np.tile(quat.IDENTITY, (3, 1))], axis=1)
    moved = [[(x, 0, 0), (0, 1, 0)] for x in (0.0, 1.0, 1.0)]
    usd_files.animation(made, "/Root/Anim", [0, 12, 30], ends, places=moved)
    saved(made)
    with pytest.raises(
        MotionFileError, match=r"/Root/Anim: found keys at uneven times.*source\.rate"
    ):
        read(path)
    found = read(path, rate=30.0)
    expected = np.minimum(np.arange(31) / 12, 1.0)
    assert found.rate == 30.0 and np.abs(found.translations[:, 0, 0] - expected).max() < 1e-6


def test_value_clips_are_followed(path, tmp_path):
    """Samples of the animation are in two files beside the stage."""
    made = usd_files.stage(path)
    usd_files.animation(made, "/Root/Anim", CODES[:1], swing())
    for name, codes in (("one.usda", CODES[:7]), ("two.usda", CODES[6:])):
        part = usd_files.stage(tmp_path / name)
        usd_files.animation(part, "/Root/Anim", codes, swing()[codes])
        saved(part)
    prim = made.GetPrimAtPath("/Root/Anim")
    prim.GetAttribute("rotations").Clear()
    clips = Usd.ClipsAPI(prim)
    clips.SetClipAssetPaths(
        Sdf.AssetPathArray([Sdf.AssetPath("one.usda"), Sdf.AssetPath("two.usda")])
    )
    clips.SetClipPrimPath("/Root/Anim")
    clips.SetClipActive([(0, 0), (6, 1)])
    clips.SetClipTimes([(0, 0), (12, 12)])
    clips.SetClipManifestAssetPath(Sdf.AssetPath("one.usda"))
    saved(made)
    found = read(path)
    assert len(found) == FRAMES and np.abs(places(found)[:, 1] - hand()).max() < 1e-6


def two_unbound(made):
    usd_files.animation(made, "/Root/Other", CODES, swing(X), bind_to=None)
    made.GetPrimAtPath("/Root/Skel").RemoveProperty("skel:animationSource")


def test_one_of_several_animations_is_chosen_by_name_path_or_number(swinging):
    with pytest.raises(MotionFileError, match="2 animations \\(/Root/Anim, /Root/Other\\)"):
        swinging(two_unbound)
    for name in ("Other", "/Root/Other", "2"):
        found = swinging(two_unbound, options={"animation": name})
        assert np.abs(places(found)[:, 1] - hand(X)).max() < 1e-6


def no_skeleton(made):
    made.RemovePrim("/Root/Skel")


def no_animation(made):
    made.RemovePrim("/Root/Anim")


def second_skeleton(made):
    UsdSkel.Root.Define(made, "/Two")
    usd_files.skeleton(made, "/Two/Skel")
    usd_files.animation(made, "/Root/Anim", CODES, swing(), bind_to="/Two/Skel")


def misordered(made):
    usd_files.skeleton(made, "/Root/Skel", joints=["upper/lower", "upper"])


def growing(made):
    sizes = np.ones((FRAMES, 2, 3)) * (1.0 + 0.01 * CODES)[:, None, None]
    usd_files.animation(made, "/Root/Anim", CODES, swing(), sizes=sizes)


def mirrored(made):
    usd_files.transform(made, "/Root", usd_files.matrix(size=-1.0))


def missing(made):
    made.GetPrimAtPath("/Root").GetReferences().AddReference("none.usda")


def dropped(made):
    for attribute in ("rotations",):
        made.GetPrimAtPath("/Root/Anim").GetAttribute(attribute).ClearAtTime(5.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (no_skeleton, "found 1 animations and no Skeleton"),
        (no_animation, "the skeleton /Root/Skel without a SkelAnimation"),
        (second_skeleton, r"2 skeletons \(/Root/Skel, /Two/Skel\).*export each character alone"),
        (misordered, "is not valid: Joint 0 has mis-ordered parent 1"),
        (growing, "'upper' has scales from 1 to 1.12"),
        (mirrored, "skews or mirrors"),
        (missing, "refers to what cannot be read.*none.usda"),
        (dropped, "1 dropped frames of 13 at 30 a second, the first after 0.1333"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_reason(swinging, change, said):
    with pytest.raises(MotionFileError, match=said) as found:
        swinging(change)
    assert "a.usda: " in str(found.value)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.usda", b"#usda 1.0\ndef {", "does not open as USD"),
        ("a.usdc", b"PXR-USDC" + bytes(50), "does not open as USD"),
        ("a.usdz", b"PK", "does not open as USD"),
        ("none.usda", None, "cannot be read: No such file"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, name, content, said):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(MotionFileError, match=said):
        read(tmp_path / name)


@pytest.mark.parametrize("seed", range(5))
def test_damaged_text_is_refused_or_read_but_never_crashes(tmp_path, swinging, seed):
    """Of text alone: usd-core takes sizes in damaged binary files as they are."""
    swinging()
    content = bytearray((tmp_path / "a.usda").read_bytes())
    rng = np.random.default_rng(seed)
    for place in rng.integers(0, len(content), 4):
        content[place] = rng.integers(0, 256)
    (tmp_path / "b.usda").write_bytes(content)
    try:
        found = read(tmp_path / "b.usda")
    except FileError:
        return
    assert np.all(np.isfinite(found.rotations))
