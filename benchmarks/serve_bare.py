"""A handler that does nothing but ask the model and write JSON: what every other is measured by.

    .venv/bin/python benchmarks/serve_bare.py MODEL PORT

The same call of onnxruntime and the same JSON as the service's, on uvicorn with uvloop and
httptools; nothing is checked, nothing named, nothing counted.
"""

import sys
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

import numpy as np
import orjson
import uvicorn

from posefield.inference import onnx_runtime, session
from posefield.model_file import onnx_file
from posefield.synthesis.poses import POSE_OUTPUTS


def main(model: Path, port: int) -> None:
    """Answer for a model until ended."""
    opened = session.load(model)
    names = [control.name for control in opened.card.controls]
    fixed = onnx_file.fix_level(model.read_bytes(), 0)
    runtime = onnx_runtime.open_session(onnx_file.select_outputs(fixed, *POSE_OUTPUTS), model.stem)
    ask, identity = runtime.run, f"{model.stem}@{opened.digest}"
    outputs = [*POSE_OUTPUTS]

    async def app(scope: Any, receive: Any, send: Any) -> None:
        options = dict(parse_qsl(scope["query_string"].decode()))
        controls, when = [float(options[name]) for name in names], float(options["time"])
        feed = {
            "controls": np.array([controls], np.float32),
            "time": np.array([[when]], np.float32),
        }
        rotations, position, offsets, duration, sigma = ask(outputs, feed)
        trust = {
            "model": identity,
            "controls": dict(zip(names, controls, strict=True)),
            "performer": None,
            "level": 0,
            "duration": float(duration[0]),
            "sigma": float(sigma[0]),
            "warnings": [],
        }
        answer = {
            "trust": trust,
            "times": [when],
            "rotations": rotations[0],
            "root_position": position[0],
            "bone_offsets": offsets[0],
        }
        body = orjson.dumps(answer, option=orjson.OPT_SERIALIZE_NUMPY)
        headers = [
            (b"content-type", b"application/json"),
            (b"content-length", b"%d" % len(body)),
        ]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    uvicorn.run(
        app,
        port=port,
        loop="uvloop",
        http="httptools",
        ws="none",
        lifespan="off",
        proxy_headers=False,
        log_level="warning",
        access_log=False,
        server_header=False,
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
