"""The model in MLServer: its protocol in, all that a pose is out."""

from typing import Any

import graph
from mlserver import MLModel
from mlserver.codecs import NumpyCodec
from mlserver.types import InferenceRequest, InferenceResponse, ResponseOutput


class Pose(MLModel):
    """The graph behind codecs of MLServer's own."""

    async def load(self) -> bool:
        """Open the file that the model's settings name."""
        self.run = graph.opened(self.settings.parameters.uri)
        return True

    async def predict(self, payload: InferenceRequest) -> InferenceResponse:
        """Outputs of the graph, each a list of numbers."""
        feed = {body.name: NumpyCodec.decode_input(body) for body in payload.inputs}
        outputs = [_output(*output) for output in zip(graph.OUTPUTS, self.run(feed), strict=True)]
        return InferenceResponse(model_name=self.name, id=payload.id, outputs=outputs)


def _output(name: str, tensor: Any) -> ResponseOutput:
    # Its codec takes longer, and would make a table of one column of what has one axis.
    data = tensor.ravel().tolist()
    return ResponseOutput(name=name, shape=list(tensor.shape), datatype="FP32", data=data)
