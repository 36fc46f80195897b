"""A small consistent model card for tests of the card's writer and reader."""

import numpy as np

from posefield.kriging.kriging_model import Hyper, LabelKernel
from posefield.model_file.model_card import (
    Control,
    Event,
    LabelSet,
    Level,
    ModelCard,
    TrainingParameters,
)
from posefield.motion.measures import Measure
from posefield.motion.skeleton import Skeleton

CARD = ModelCard(
    name="reaching",
    description="Reaches for a target, d’un geste.",
    controls=(
        Control("height", "m", "stature", 1.6, 1.9, 1.75, (1.6, 1.75, 1.9), Measure("stature")),
        Control("turn", "deg", "where the target is", -60.0, 60.0, 0.1, ()),
    ),
    skeleton=Skeleton(
        ("hips", "chest"),
        (-1, 0),
        np.array([[0.0, 0.9, 0.0], [0.0, 0.25, -0.01]]),
        (1,),
        np.array([[0.0, 0.1, 0.0]]),
    ),
    cyclic=True,
    root="travelling",
    rate=60.0,
    frames=100,
    samples=3,
    levels=(
        Level((22, 6, 24), 3, (0, 1), 9000, 36000, 8000, 0.005, 0.014, 0.02, 0.05, 0.009),
        Level((9, 3, 8), 2, (0,), 900, 3600, 700, 0.02, 0.05, 0.06, 0.2, None),
    ),
    durations=(0.8, 1.9),
    labels=(LabelSet("performer", ("ada", "bob"), (0, 1, 0)),),
    examples=((1.6, -60.0), (1.75, 0.1), (1.9, 60.0)),
    feet=(1,),
    diagnostics={
        "truncation_rms_m": 0.005,
        "truncation_p99_m": 0.014,
        "truncation_max_m": 0.05,
        "compression": {"core": 68.63, "stored": 30.9},
        "leave_one_out_rms_m": 0.03,
        "explained": {"pose": 0.9},
        "covariance": "matern52",
        "drift": [0, 1],
        "scales": [0.3, 0.3],
        "nugget": 0.001,
        "trend": 2.5,
        "labels": {"performer": {"correlation": 0.7, "offset": 0.4}},
        "tensor": [9, 100, 3],
        "parity_m": 2e-06,
        "notes": ["one"],
    },
    provenance={
        "licence": "CC0",
        "recipe_sha256": "ab",
        "data_sha256": "cd",
        "clips": 3,
        "versions": {"numpy": "2.4.6"},
    },
    sources=("a.bvh", "b.bvh, frames 3 to 90", "c.bvh"),
    kriging=Hyper(
        "matern52", (0,), np.array([0.3, 0.1 + 0.2]), 1e-3, 2.5, (LabelKernel(2, 0.7, 0.4),)
    ),
    left_out=(0.01, 0.02, 0.5),
    joint_sigma=(0.5, 1.32),
    making=TrainingParameters(
        {"warp": (0.25, 1.0, 0.0)},
        {"peak": 0.4},
        {"chest": 2.0},
        True,
        takes=(0, 0, 1),
        take_root=((0.1,) * 28, (0.2,) * 28, (0.3,) * 28, (0.4,) * 28),
        detail=np.full((3, 22), 0.5, dtype="<f2").tobytes(),
    ),
    roles={"hips": "hips", "upperChest": "chest"},
    event=Event(1, 0.75),
    beside=((0.1, 0.0, 0.0, 0.0), (0.2, 0.3, 0.0, 0.0), (0.1, 0.1, 0.1, 0.0), (0.0, 0.0, 0.0, 0.1)),
)
