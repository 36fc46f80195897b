"""Kernel table of a model: its constants laid out for a kernel that computes one pose a workgroup.

A table is float32 arrays in a safetensors file (https://github.com/huggingface/safetensors): eight
bytes with the length of a JSON header, the header, and the arrays. docs/reference/model-file.md
lists the arrays and their shapes. A level k has arrays of its own, named `..._k`.
"""

from collections.abc import Mapping

import numpy as np
import orjson

from posefield.common.units import Floats
from posefield.encode.files.media_types import Format
from posefield.inference import reduced_motion
from posefield.inference.reduced_motion import GraphConstants, ReducedTensor
from posefield.kriging.covariance import KERNEL_GAINS
from posefield.model_file import subgraph
from posefield.model_file.model_card import ModelCard
from posefield.motion import skeleton

FORMAT = Format("safetensors", "application/vnd.safetensors")
ALIGNMENT = 8
"""Bytes of which the length of the header is a multiple, so that the arrays are aligned."""

Arrays = dict[str, Floats]


def kernel_table(content: bytes, card: ModelCard, identity: str) -> bytes:
    """Return the kernel table of a model file; identity: of the model, stored in the table."""
    facts = {
        "covariance": card.kriging.covariance,
        "chart": card.making.chart,
        "cyclic": "true" if card.cyclic else "false",
        "model": identity,
    }
    return safetensors(arrays(subgraph.initializers(content), card), facts)


def safetensors(named: Arrays, facts: Mapping[str, str]) -> bytes:
    """Return a safetensors file of float32 arrays by name, with texts by key as its metadata."""
    header: dict[str, object] = {"__metadata__": dict(facts)}
    parts, at = [], 0
    for name, own in named.items():
        part = own.astype("<f4").tobytes()
        ends = [at, at + len(part)]
        header[name] = {"dtype": "F32", "shape": list(own.shape), "data_offsets": ends}
        parts.append(part)
        at += len(part)
    text = orjson.dumps(header)
    text += b" " * (-len(text) % ALIGNMENT)
    return b"".join([len(text).to_bytes(8, "little"), text, *parts])


def arrays(weights: GraphConstants, card: ModelCard) -> Arrays:
    """Return the arrays of the table; KeyError for a missing constant of the graph."""
    found = _controls(weights, card) | _labels(weights, card) | _timing(weights, card)
    found |= _body(weights, card)
    for index, level in enumerate(card.levels):
        tensor = reduced_motion.read(weights, level, card)
        r2, r1, r3 = tensor.core.shape
        found |= {
            f"weights_{index}": _level_weights(weights, card, index),
            f"time_{index}": tensor.time,
            f"core_{index}": tensor.core.reshape(r2 * r1, r3).T,
            f"pose_{index}": _pose(tensor),
        }
    return found


def _controls(weights: GraphConstants, card: ModelCard) -> Arrays:
    d = len(card.controls)
    scales = np.sqrt(KERNEL_GAINS[card.kriging.covariance] * weights["squared_scales"][:, 0])
    return {
        "control_gain": np.diag(weights["control_gain"][:, -d:]),
        "control_shift": weights["control_shift"][-d:],
        "control_scales": scales,
        "samples": weights["samples"] * scales[:, None],
    }


def _labels(weights: GraphConstants, card: ModelCard) -> Arrays:
    """Return the parts of the covariances that depend on labels; empty without label sets."""
    sets = range(len(card.labels))
    if not sets:
        return {}
    return {
        "label_correlations": np.array([weights[f"correlation_{i}"].item() for i in sets]),
        "label_samples": np.array([weights[f"whose_{i}"] for i in sets]),
    }


def _timing(weights: GraphConstants, card: ModelCard) -> Arrays:
    d = len(card.controls)
    law: Arrays = {"duration_floor": np.ones(d), "duration_exponents": np.zeros(d)}
    if "duration_floor" in weights:
        law["duration_floor"] = weights["duration_floor"][:d]
        law["duration_exponents"] = weights["duration_exponents"][:d, 0]
    return {
        **law,
        "warp_still": weights["warp_still"],
        "warp_breaks": weights["warp_breaks"][:, 0, 0],
        "warp_form": weights["warp_form"],
    }


def _body(weights: GraphConstants, card: ModelCard) -> Arrays:
    parents = card.skeleton.parents
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(parents), 1))
    return {
        "offset_mean": weights["offset_mean"],
        "offset_directions": weights["offset_directions"],
        "mean_rotations": weights["mean_rotations"][:, :, 0],
        "parents": np.array(parents, dtype=np.float64),
        "rest": skeleton.positions(parents, still, card.skeleton.offsets),
    }


def _level_weights(weights: GraphConstants, card: ModelCard, level: int) -> Floats:
    """Return the kriging weights (p + 1 + d + n_k, M) of a level, without those of sigma."""
    if level:
        return np.asarray(weights[f"weights_{level}"][:, 1:])
    n = weights["samples"].shape[1]
    widths = {"offsets": len(weights["offset_directions"]), "duration": 1}
    widths |= {"warp": len(weights["warp_still"])}
    if card.cyclic:
        widths = {"travel": 3, **widths}
    # A quantity that does not depend on the controls has no weights of covariances.
    duals = [
        weights.get(f"{name}_weights", np.zeros((n, width), np.float32))
        for name, width in widths.items()
    ]
    # The first two columns are those of sigma.
    own = np.hstack([*duals, weights["pose_weights"]])
    return np.vstack([weights["linear_weights"][:, 2:], own])


def _pose(tensor: ReducedTensor) -> Floats:
    """Return the mean of the pose numbers and their directions, (1 + r1, 3 + 4 J)."""
    mean, directions = tensor.mean_products
    root = np.vstack([tensor.mean[:3], tensor.directions[:, :3]])
    return np.hstack([root, np.vstack([mean, directions])])
