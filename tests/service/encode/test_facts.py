import numpy as np
import pytest
from pxr import Sdf

from posefield.encode import layers

GIVEN = {
    "model": "walk@1",
    "seed": 2**63 - 1,
    "huge": 2**64,
    "yes": True,
    "none": None,
    "speed": np.float32(1.5),
    "count": np.int64(3),
    "ranks": (22, 6, 24),
    "range": [0, 1.5],
    "array": np.array([0.25, 0.5]),
    "warnings": [],
    "names": ["a", "b"],
    "levels": [{"rank": 1, "who": None}, {"rank": 2}],
}
READ = {
    "model": "walk@1",
    "seed": 2**63 - 1,
    "huge": str(2**64),
    "yes": True,
    "speed": 1.5,
    "count": 3,
    "ranks": [22, 6, 24],
    "range": [0.0, 1.5],
    "array": [0.25, 0.5],
    "warnings": [],
    "names": ["a", "b"],
    "levels": {"0": {"rank": 1}, "1": {"rank": 2}},
}


@pytest.mark.parametrize("ending", ["usda", "usdc"])
def test_facts_are_read_back(ending, tmp_path):
    made = Sdf.Layer.CreateNew(str(tmp_path / f"facts.{ending}"))
    made.customLayerData = {"posefield": layers.usd_dictionary(GIVEN)}
    made.Save()
    copy = tmp_path / f"copy.{ending}"
    copy.write_bytes((tmp_path / f"facts.{ending}").read_bytes())
    assert plain(Sdf.Layer.FindOrOpen(str(copy)).customLayerData["posefield"]) == READ


def plain(value):
    if isinstance(value, dict):
        return {name: plain(entry) for name, entry in value.items()}
    return value if isinstance(value, str | bool | int | float) else list(value)
