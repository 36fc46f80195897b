"""The model in BentoML: controls and a time in, JSON by orjson out."""

import os
from typing import Annotated

import bentoml
import graph
import numpy as np
import orjson
from bentoml.validators import ContentType

QUIET = {"access": {"enabled": False}}


@bentoml.service(workers=1, metrics={"enabled": False}, logging=QUIET)
class Pose:
    """The graph, asked for one pose at a time."""

    def __init__(self) -> None:
        self.run = graph.opened(os.environ["MODEL"])

    @bentoml.api
    async def pose(
        self, controls: list[float], time: list[float]
    ) -> Annotated[bytes, ContentType("application/json")]:
        """Outputs of the graph by name; async, for a thread would cost more than the graph."""
        body = {"controls": controls, "time": time}
        outputs = self.run({name: np.array([row], np.float32) for name, row in body.items()})
        answer = {name: output[0] for name, output in zip(graph.OUTPUTS, outputs, strict=True)}
        return orjson.dumps(answer, option=orjson.OPT_SERIALIZE_NUMPY)
