"""Tests of the compiled kernels against the model and naive kriging."""

import numpy as np
import pytest
from paper import poses, precomputation

from posefield_train.tensor.decoder import Decoder

# Compiling the kernels takes longer than a unit test may.
pytestmark = pytest.mark.system

RANKS = (12, 5, 10)
# Sums of a hundred products in another order, in float64.
EXACT = 1e-9


@pytest.fixture(scope="module")
def question(made):
    return poses.questions(made, 40)


@pytest.fixture(scope="module")
def field(made):
    fitter = precomputation.FITS["our own linearised grid search"]
    return precomputation.naive(made, fitter)


def test_compiled_poses_are_those_of_the_decoder(made, question):
    reduced, own = precomputation.ours(made, RANKS)
    tensor = made.trained.tensor
    decoder = Decoder(reduced, tensor.mean, tensor.unwhiten, tensor.chart)
    found = poses.ours(made, reduced, own, question)()

    def expected(points, places):
        reduced_poses = decoder.reduced_poses(own.predict(points), places[:, None])[:, 0]
        return (decoder.mean + reduced_poses @ decoder.directions)[:, made.varies]

    assert np.abs(found - expected(question.points, question.places)).max() < EXACT
    assert np.abs(found - expected(question.points, question.frames)).max() > 1e-4


@pytest.mark.parametrize("form", poses.FORMS)
def test_compiled_naive_poses_are_those_of_naive_kriging(made, question, field, form):
    found = poses.naive(field, question)[form]()
    frames, each = field.numpy(question.points), np.arange(len(question.points))
    before = question.frames.astype(int)
    share = (question.places - before)[:, None]
    if form != "LU, between frames":
        share = np.zeros_like(share)
    expected = (1.0 - share) * frames[each, before] + share * frames[each, before + 1]
    # Solved, inverted, multiplied: a system of condition 1e4.
    assert np.abs(found - expected).max() < EXACT
    assert np.abs(found - frames[each, before + 1]).max() > 1e-4
