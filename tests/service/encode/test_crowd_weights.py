"""Curves of crowds in USD and npz, with usd-core as the oracle, and the predicted sizes."""

from dataclasses import replace

import conftest
import crowds
import numpy as np
import pytest
from pxr import Usd, UsdSkel

from posefield.encode import crowd_writer, motion_tables

MOTION, FRAMES = [0, 1, 2, 0], 7
FLOAT32 = 1e-7


@pytest.fixture(scope="module")
def made():
    return crowds.motions(conftest.person(), 3, FRAMES, curves=len(crowds.CURVES))


def crowd(made):
    return crowds.crowd(conftest.person(), made, MOTION, size=2)


def written(made, path, instancing, body="mannequin"):
    crowd_writer.write(crowd(made), path, instancing, body)
    return Usd.Stage.Open(str(path))


def skinned(stage):
    """The animation and the skinned body of each character, and what has to be kept for both."""
    cache, found = UsdSkel.Cache(), []
    for prim in stage.GetPrimAtPath("/Crowd/Characters").GetChildren():
        root = UsdSkel.Root(prim)
        assert cache.Populate(root, Usd.TraverseInstanceProxies())
        (binding,) = cache.ComputeSkelBindings(root, Usd.TraverseInstanceProxies())
        query = cache.GetSkelQuery(binding.GetSkeleton()).GetAnimQuery()
        found.append((query, binding.GetSkinningTargets()[0]))
    return (stage, cache), found


def weights(query):
    return np.array([query.ComputeBlendShapeWeights(frame) for frame in range(FRAMES)])


@pytest.mark.parametrize(("ending", "instancing"), crowds.LAYOUTS)
def test_usd_skel_reads_the_weights_of_every_character(made, ending, instancing, tmp_path):
    _kept, found = skinned(written(made, tmp_path / f"crowd.{ending}", instancing))
    assert len(found) == len(MOTION)
    for (query, body), played in zip(found, MOTION, strict=True):
        assert tuple(query.GetBlendShapeOrder()) == crowds.CURVES
        assert np.abs(weights(query) - made.curves[played]).max() < FLOAT32
        assert np.abs(weights(query) - made.curves[played - 1]).max() > 0.1
        # The body of each character takes all of them.
        assert tuple(body.GetBlendShapeOrder()) == crowds.CURVES
        assert body.HasBlendShapes()


def test_npz_has_the_curves_of_every_character(made, tmp_path):
    motion_tables.write_npz(crowd(made), tmp_path / "crowd.npz")
    with np.load(tmp_path / "crowd.npz") as found:
        assert found["curve_names"].tolist() == list(crowds.CURVES)
        assert np.array_equal(found["curves"], made.curves[MOTION])
    motion_tables.write_npz(crowd(replace(made, curves=None)), tmp_path / "crowd.npz")
    with np.load(tmp_path / "crowd.npz") as found:
        assert not [name for name in found.files if "curve" in name]
