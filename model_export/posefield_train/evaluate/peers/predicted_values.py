"""Values that every peer predicts, with the performer known and with the performer left open."""

from collections.abc import Mapping
from dataclasses import dataclass

from posefield.common.units import Floats
from posefield_train.evaluate.peers import gaussian_process, interpolation_peers, linear_smoothers
from posefield_train.evaluate.peers.interpolation_peers import LINEAR_PEERS, Interpolator
from posefield_train.evaluate.peers.linear_smoothers import LinearSmoother
from posefield_train.kriging.sample_points import SamplePoints

GP, SAME_PERFORMER = "gp", "nearest_same_performer"
OFFSETS_OF = "thin_plate_smoothed"
"""Peer whose offsets of performers the paper's per-frame kriging gets."""
OPEN = "_no_performer"
"""End of the name of a method that is not told the performer, where others are."""
DEFINITIONS = {
    GP: "scikit-learn GaussianProcessRegressor, ARD RBF + white noise, label as columns",
    SAME_PERFORMER: "scikit-learn, nearest of the same performer",
    **{name: words for name, (_, words) in LINEAR_PEERS.items()},
}
"""Definition of each peer."""

Values = Mapping[str, Floats]
"""Values (n, m) or predictions (q, m) of each quantity, by name."""


@dataclass(frozen=True)
class PeerPredictions:
    """Predictions of all peers.

    values: by the peer's name. offsets: of the performers (p, m), by quantity, as OFFSETS_OF
    estimates them.
    """

    values: dict[str, Values]
    offsets: Values


def predict(samples: SamplePoints, values: Values, queries: Floats) -> PeerPredictions:
    """Return the predictions of every peer at queries (q, d + p).

    Where performers have labels, each peer is there twice: told the performer, and with OPEN at the
    end of its name with controls alone.
    """
    found: dict[str, Values] = {}
    offsets: Values = {}
    for name, (settings, _) in LINEAR_PEERS.items():
        choices = [linear_smoothers.smoother(peer, samples, queries) for peer in settings]
        found |= _linear(name, choices, samples, values, queries)
        if name == OFFSETS_OF:
            offsets = {
                key: linear_smoothers.chosen_offsets(choices, samples, own)
                for key, own in values.items()
            }
    found[GP] = _each(gaussian_process.gp_with_performers, samples, values, queries)
    if samples.labels:
        alone = gaussian_process.gp_without_performers
        found[GP + OPEN] = _each(alone, samples, values, queries)
        nearest = interpolation_peers.nearest_of_performer
        found[SAME_PERFORMER] = _each(nearest, samples, values, queries)
    return PeerPredictions(found, offsets)


def _each(peer: Interpolator, samples: SamplePoints, values: Values, queries: Floats) -> Values:
    return {key: peer(samples, own, queries) for key, own in values.items()}


def _linear(
    name: str,
    choices: list[LinearSmoother],
    samples: SamplePoints,
    values: Values,
    queries: Floats,
) -> dict[str, Values]:
    alone = {key: linear_smoothers.predict(choices, own) for key, own in values.items()}
    if not samples.labels:
        return {name: alone}
    told = {
        key: linear_smoothers.predict_with_performers(choices, samples, own, queries)
        for key, own in values.items()
    }
    return {name: told, name + OPEN: alone}
