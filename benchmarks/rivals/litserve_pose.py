"""The model in LitServe: controls and a time in, JSON by orjson out.

python litserve_pose.py MODEL PORT
"""

import sys
from typing import Any

import graph
import litserve
import numpy as np
import orjson
from starlette.responses import Response


class Pose(litserve.LitAPI):
    """The graph, asked for one pose at a time."""

    def setup(self, device: str) -> None:
        """Open the model."""
        self.run = graph.opened(sys.argv[1])

    def decode_request(self, request: dict[str, Any]) -> dict[str, Any]:
        """Inputs of the graph."""
        return {name: np.array([row], np.float32) for name, row in request.items()}

    def predict(self, feed: dict[str, Any]) -> list[Any]:
        """Outputs of the graph."""
        return self.run(feed)

    def encode_response(self, outputs: list[Any]) -> Response:
        """Them by name."""
        answer = {n: output[0] for n, output in zip(graph.OUTPUTS, outputs, strict=True)}
        content = orjson.dumps(answer, option=orjson.OPT_SERIALIZE_NUMPY)
        return Response(content, media_type="application/json")


if __name__ == "__main__":
    server = litserve.LitServer(Pose(), accelerator="cpu", fast_queue=True)
    server.run(
        host="127.0.0.1",
        port=int(sys.argv[2]),
        num_api_servers=1,
        log_level="warning",
        access_log=False,
        generate_client_file=False,
    )
