"""Tests of the residual covariance: from the model file, equal to that of training."""

import numpy as np
import pytest

from posefield.constraints import constrained_motion
from posefield.inference import residual_covariance, session
from posefield.kriging import leave_one_out
from posefield.model_file import subgraph


def strays(trained) -> np.ndarray:
    """Return training's standardised leave-one-out errors of each clip's coefficients (n, r3)."""
    pose, laid, model = trained.pose, trained.samples, trained.model
    left_out = leave_one_out.leave_out(pose.hyper, laid.points, laid.groups)
    sigmas = np.sqrt(model.bank.sill * pose.variances * len(laid.points))
    return left_out @ model.decoder.reduced.bases[2] / sigmas[:, None]


def gap(found, trained) -> float:
    """Return the distance of a spread's covariance from training's, as a share of the latter."""
    # Training has degrees of freedom before frames.
    core = trained.model.decoder.reduced.core.swapaxes(0, 1)
    rows = strays(trained) @ core.reshape(-1, found[1]).T
    expected = rows.T @ rows
    own = found[0].residuals @ found[0].residuals.T
    return float(np.linalg.norm(own - expected) / np.linalg.norm(expected))


def test_coefficients_are_read_off_the_weights_of_the_file(labelled, labelled_exported):
    """The file holds its samples in an order of its own."""
    opened = session.open_bytes(labelled_exported.content, "labelled.onnx")
    weights = subgraph.initializers(opened.content)
    samples = opened.kriging_weights.samples
    found = residual_covariance.sample_coefficients(opened.card, weights, samples)
    bases = labelled.model.decoder.reduced.bases[2]
    order = residual_covariance.importance_order(opened.card, weights, samples)
    assert np.abs(found - bases).max() < 1e-5
    assert not np.array_equal(order, np.arange(len(order)))
    # Negative control: in the order of the file they are other clips'.
    assert np.abs(found[order] - bases).max() > 1e-2


def read(content):
    """Spread of a file's finest level, and its rank of samples."""
    own = constrained_motion.build_corrector(session.open_bytes(content, "x.onnx"), 0)
    return own.spread, own.reduced.core.shape[2]


def test_residuals_have_the_covariance_of_training(labelled, labelled_exported):
    found = read(labelled_exported.content)
    assert gap(found, labelled) < 1e-3
    own = found[0]
    missed = (own.captured - own.predicted) / own.sigmas[:, None]
    expected = own.residuals @ own.residuals.T
    assert np.abs(missed.T @ missed - expected).max() < 1e-6 * np.abs(expected).max()
    # Negative control: residuals of clips in another order have another.
    mixed = (own.captured - own.predicted[::-1]) / own.sigmas[:, None]
    assert np.abs(mixed.T @ mixed - expected).max() > 0.1 * np.abs(expected).max()


def test_the_metric_is_a_covariance(walking, rng):
    own, size = walking.bench.spread, walking.held.scene.numbers
    full = own.apply_shrunk(np.eye(size))
    assert np.abs(full - full.T).max() < 1e-12 * np.abs(full).max()
    assert np.linalg.eigvalsh(full).min() > -1e-12 * np.abs(full).max()
    gradients = rng.standard_normal((2, size))
    assert np.allclose(own.apply_shrunk(gradients), full @ gradients.T)
    # Shrinking keeps the size of it all.
    inner = own.residuals @ own.residuals.T
    kept = np.trace(full) - np.trace(own.beside)
    assert kept == pytest.approx(np.trace(inner))
