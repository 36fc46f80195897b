"""Tests of grids of sigma over HTTP: equal in all formats, and errors."""

import io
import json

import msgpack
import numpy as np
import pyarrow as pa
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app

SIGMA = "/v1/models/reach/sigma"
ASKED = "across=turn&along=target_height&columns=5&rows=3&margin=0.5&hip_height=0.9"


def test_every_format_holds_the_same_grid(ask):
    plain, packed, archive, stream = (
        ask("GET", f"{SIGMA}.{e}?{ASKED}").content for e in ("json", "msgpack", "npz", "arrow")
    )
    plain, packed, archive = (
        json.loads(plain),
        msgpack.unpackb(packed),
        np.load(io.BytesIO(archive)),
    )
    (batch,) = pa.ipc.open_stream(stream)
    sigma = np.array(plain["sigma"], np.float32)
    assert sigma.shape == (3, 5) and np.ptp(sigma) > 1e-3
    raw = packed["sigma"]
    assert np.array_equal(np.frombuffer(raw["data"], raw["dtype"]).reshape(raw["shape"]), sigma)
    assert np.array_equal(archive["sigma"], sigma)
    assert np.array_equal(np.asarray(batch.column("sigma")).reshape(3, 5), sigma)
    for name in ("inside", "supported"):
        assert archive[name].tolist() == plain[name]
        assert batch.column(name).to_pylist() == np.ravel(plain[name]).tolist()
        assert 0 < np.sum(plain[name]) < 15
    assert batch.column("across_values").to_pylist() == plain["across_values"] * 3
    assert batch.column("along_values").to_pylist()[::5] == plain["along_values"]
    assert archive["across_values"].tolist() == plain["across_values"]
    facts = {k.decode()[10:]: json.loads(v) for k, v in batch.schema.metadata.items()}
    for name in ("model", "across", "along", "controls", "performer", "units"):
        assert facts[name] == packed[name] == plain[name]
    assert (str(archive["across"]), json.loads(str(archive["controls"]))) == (
        "turn",
        plain["controls"],
    )


def test_how_large_a_grid_may_be_is_a_setting(loaded):
    small = asker(create_app(loaded, Settings(grid_limit=15)))
    assert small("GET", f"{SIGMA}?{ASKED}").status_code == 200
    refused = small("GET", f"{SIGMA}?across=turn&along=stature&rows=4&columns=4")
    assert refused.status_code == 422 and "expected at most 15" in refused.json()["detail"]
