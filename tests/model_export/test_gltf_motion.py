"""Tests of reading glTF: curves, accessors, skeletons, and what is refused."""

import base64

import numpy as np
import pytest
from gltf_files import GltfFile, arm

from posefield.common.errors import FileError, MotionFileError
from posefield.motion import quat
from posefield.motion.skeleton import positions
from posefield_train.source import motion_readers
from posefield_train.source.motion_file import ReadOptions

FRAMES = 13
TIMES = np.arange(FRAMES) / 30.0
QUARTER = np.sin(np.pi / 4)
X, Y, Z = np.eye(3)


def swing(axis=Z, most=1.2):
    """Rotations w x y z that swing about an axis, one a frame."""
    return quat.from_axis_angle(axis, most * np.sin(9.0 * TIMES))


def xyzw(turns):
    return turns[..., [1, 2, 3, 0]]


def swinging(file, node=0, turns=None):
    return file.animate(
        (node, "rotation", TIMES, xyzw(swing() if turns is None else turns), "LINEAR")
    )


@pytest.fixture
def read(tmp_path):
    """Function that reads a document or bytes, as a file of a name."""

    def of(file, name="a.glb", **options):
        content = file.glb() if isinstance(file, GltfFile) else file
        (tmp_path / name).write_bytes(content)
        return motion_readers.read(tmp_path / name, ReadOptions(**options))

    return of


def places(file):
    return positions(file.skeleton.parents, file.rotations, file.translations)


def hand():
    """Return the positions (F, 3) of the lower joint of the swinging arm."""
    return quat.rotate(swing(), np.broadcast_to(Y, (FRAMES, 3)))


def test_an_animated_arm_is_read(read):
    found = read(swinging(GltfFile(arm(), [{"joints": [0, 1]}])))
    assert (found.format, found.rate, found.metres_per_unit, found.up) == ("glTF", 30.0, 1.0, "y")
    assert found.skeleton.names == ("upper", "lower") and found.skeleton.parents == (-1, 0)
    assert np.abs(places(found)[:, 1] - hand()).max() < 1e-6
    assert np.abs(places(found)[:, 1] - Y).max() > 0.1


@pytest.mark.parametrize(("kind", "error"), [("i2", 1e-4), ("i1", 2e-2), ("f4", 1e-6)])
def test_quantized_rotations_are_shares_of_the_largest_integer(read, kind, error):
    file = GltfFile(arm(), [{"joints": [0, 1]}])
    out = file.accessor(xyzw(swing()), kind, normalized=kind != "f4")
    found = read(file.animate((0, "rotation", TIMES, out, "LINEAR")))
    assert np.abs(places(found)[:, 1] - hand()).max() < error


def test_sparse_values_replace_those_of_the_view(read):
    file = GltfFile(arm(), [{"joints": [0, 1]}])
    rows = np.array([3, 7], "<u2")
    values = np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 0.0]], "<f4")
    sparse = {
        "count": 2,
        "indices": {"bufferView": file.view(rows.tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(values.tobytes())},
    }
    out = file.accessor(np.zeros((FRAMES, 3)), sparse=sparse)
    found = read(file.animate((0, "translation", TIMES, out, "LINEAR")))
    expected = np.zeros((FRAMES, 3))
    expected[[3, 7]] = values
    assert np.abs(found.translations[:, 0] - expected).max() == 0.0


def test_interpolations_follow_the_format(read):
    """Two keys a second apart, sampled at 20 frames a second: constant, straight and Hermite."""
    ends = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    slow = np.zeros((2, 3))
    spline = np.stack([slow, ends, slow], axis=1).reshape(-1, 3)
    share = np.arange(21) / 20.0
    for interpolation, values, expected in (
        ("STEP", ends, np.where(share < 1.0, 0.0, 1.0)),
        ("LINEAR", ends, share),
        ("CUBICSPLINE", spline, 3 * share**2 - 2 * share**3),
    ):
        file = GltfFile(arm(), [{"joints": [0, 1]}])
        file.animate((0, "translation", [0.0, 1.0], values, interpolation))
        found = read(file, rate=20.0)
        assert found.rate == 20.0
        assert np.abs(found.translations[:, 0, 0] - expected).max() < 1e-6, interpolation


def test_tangents_of_a_spline_are_scaled_by_the_time_between_keys(read):
    """x = t² + t between two keys 2 s apart has tangents 1 and 5."""
    values = [[0, 0, 0], [0, 0, 0], [1, 0, 0], [5, 0, 0], [6, 0, 0], [0, 0, 0]]
    file = GltfFile(arm(), [{"joints": [0, 1]}])
    found = read(file.animate((0, "translation", [0.0, 2.0], values, "CUBICSPLINE")), rate=10.0)
    times = np.arange(21) / 10.0
    assert np.abs(found.translations[:, 0, 0] - (times**2 + times)).max() < 1e-6


def test_a_turned_and_scaled_armature_above_the_root_counts(read):
    """As of tools that keep centimetres with z up below a node of their own."""
    outer = {"rotation": [-QUARTER, 0, 0, QUARTER], "scale": [0.01] * 3, "translation": [3, 0, 0]}
    nodes = [
        {"name": "Armature", "children": [1], **outer},
        {"name": "upper", "children": [2]},
        {"name": "lower", "translation": [0.0, 0.0, 100.0]},
    ]
    found = read(swinging(GltfFile(nodes, [{"joints": [1, 2]}]), 1, swing(Y)))
    own = quat.rotate(swing(Y), np.broadcast_to(Z, (FRAMES, 3)))
    # The armature turns its z to y, and its y to -z.
    expected = own[:, [0, 2, 1]] * [1, 1, -1] + [3, 0, 0]
    assert np.abs(places(found)[:, 1] - expected).max() < 1e-6
    assert np.abs(found.skeleton.offsets[1] - Y).max() < 1e-6


def test_the_bind_pose_becomes_the_rest_pose_with_identity_rotations(read):
    """A bone along its own y, as Blender writes them: the joint is turned, the bone along x."""
    turn = [0, 0, -QUARTER, QUARTER]
    nodes = [
        {"name": "upper", "children": [1], "rotation": turn},
        {"name": "lower", "translation": [0.0, 1.0, 0.0]},
    ]
    inverse = np.eye(4)
    inverse[:3, :3] = quat.to_matrix(quat.conj(np.array([QUARTER, 0, 0, -QUARTER])))
    file = GltfFile(nodes)
    bind = file.accessor(np.stack([inverse.T.ravel()] * 2))
    file.facts["skins"] = [{"joints": [0, 1], "inverseBindMatrices": bind}]
    found = read(swinging(file))
    assert np.abs(found.skeleton.offsets[1] - X).max() < 1e-6
    assert np.abs(places(found)[:, 1] - hand()).max() < 1e-6


def test_nodes_without_a_skin_are_joints_with_a_note(read):
    found = read(swinging(GltfFile(arm())))
    assert found.skeleton.names == ("upper", "lower")
    assert "tree of animated nodes" in found.notes[0]


def test_one_of_several_animations_is_chosen_by_name(read):
    file = swinging(GltfFile(arm(), [{"joints": [0, 1]}]))
    file.animate((0, "translation", TIMES, np.outer(TIMES, X), "LINEAR"), name="slide")
    for wanted in ("slide", "2"):
        found = read(file, animation=wanted)
        assert np.abs(found.translations[:, 0] - np.outer(TIMES, X)).max() < 1e-6
    with pytest.raises(
        MotionFileError, match=r"2 animations \(1 'walk', 2 'slide'\), expected one"
    ):
        read(file)
    with pytest.raises(MotionFileError, match="'walk', 'slide', expected one 'run'"):
        read(file, animation="run")


def test_buffers_may_be_data_or_files_beside(read, tmp_path):
    file = swinging(GltfFile(arm(), [{"joints": [0, 1]}]))
    inline = "data:application/octet-stream;base64," + base64.b64encode(file.binary).decode()
    (tmp_path / "a b.bin").write_bytes(file.binary)
    for uri in (inline, "a%20b.bin"):
        found = read(file.text(uri), "a.gltf")
        assert np.abs(places(found)[:, 1] - hand()).max() < 1e-6
    for uri, said in (("../b.bin", "below its folder"), ("none.bin", "no file 'none.bin'")):
        with pytest.raises(FileError, match=said):
            read(file.text(uri), "a.gltf")


def edited(**changes):
    file = swinging(GltfFile(arm(), [{"joints": [0, 1]}]))
    file.facts |= changes
    return file


def scaled(values):
    file = swinging(GltfFile(arm(), [{"joints": [0, 1]}]))
    curves = file.facts["animations"][0]
    curves["channels"].append({"sampler": 1, "target": {"node": 0, "path": "scale"}})
    curves["samplers"].append({"input": file.accessor(TIMES), "output": file.accessor(values)})
    return file


def compressed():
    file = edited(extensionsRequired=["EXT_meshopt_compression"])
    file.facts["bufferViews"][1]["extensions"] = {"EXT_meshopt_compression": {}}
    return file


def two_skeletons():
    nodes = [
        {"name": "scene", "children": [1, 3]},
        {"name": "a", "children": [2]},
        {"name": "b"},
        {"name": "c", "children": [4]},
        {"name": "d"},
    ]
    file = GltfFile(nodes, [{"joints": [1, 2]}, {"joints": [3, 4]}])
    return file.animate(*((node, "rotation", TIMES, xyzw(swing()), "LINEAR") for node in (1, 3)))


GROWING = np.outer(1.0 + TIMES, np.ones(3))
UNEVEN = np.array([0.0, 0.1, 0.15, 0.4])
LOST = np.delete(np.arange(40) / 30.0, [11, 12])


def keyed(times):
    values = np.outer(np.asarray(times), X)
    return GltfFile(arm(), [{"joints": [0, 1]}]).animate(
        (0, "translation", times, values, "LINEAR")
    )


@pytest.mark.parametrize(
    ("file", "said"),
    [
        (b"", "not glTF"),
        (lambda: edited().glb()[:-40], "the file is not whole"),
        (b'{"asset": {"version": "1.0"}}', "'1.0' of glTF, expected 2.0"),
        (b'{"asset": {"version": "2.0"}, "nodes": 3}', "breaks its format"),
        (edited(animations=[]), "no animation, a skeleton or mesh without motion"),
        (edited(nodes=arm(translation=[1e400, 0, 0])), "node 0 has numbers that are not finite"),
        (edited(scene=1e400), "not glTF: cannot convert float infinity"),
        (compressed(), "buffer view 1 requires the extension EXT_meshopt_compression"),
        (swinging(GltfFile([{"name": "box"}])), "'box' without a skeleton"),
        (two_skeletons(), r"2 skeletons \(a, c\), expected one"),
        (scaled(GROWING), "'upper' has scales from 1 to 1.4"),
        (scaled(np.tile([1.0, 2.0, 1.0], (FRAMES, 1))), "one positive scale along all axes"),
        (keyed(UNEVEN), "uneven times, 0.05 to 0.25 s apart.*source.rate"),
        (keyed(LOST), "2 dropped frames of 40 at 30 a second, the first after 0.333.*source.rate"),
        (keyed([0.0, 0.2, 0.1]), "increasing times"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_reason(read, file, said):
    with pytest.raises(MotionFileError, match=said) as found:
        read(file() if callable(file) else file)
    assert "a.glb: " in str(found.value)


def test_a_constant_scale_is_baked_into_the_bones(read):
    found = read(scaled(np.full((FRAMES, 3), 2.0)))
    assert np.abs(places(found)[:, 1] - 2.0 * hand()).max() < 1e-5


def assert_read_or_refused(read, content, name):
    """Read a file; any other error than one that names the file is raised."""
    try:
        found = read(content, name)
    except FileError:
        return
    assert np.all(np.isfinite(found.rotations)) and np.all(np.isfinite(found.translations))


@pytest.mark.parametrize("seed", range(60))
def test_a_damaged_file_is_refused_or_read_but_never_crashes(read, seed):
    content = bytearray(edited().glb())
    rng = np.random.default_rng(seed)
    for place in rng.integers(0, len(content), 4):
        content[place] = rng.integers(0, 256)
    assert_read_or_refused(read, bytes(content), "a.glb")
