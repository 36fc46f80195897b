"""MLServer runtime of a model file: onnxruntime behind MLServer's protocol and codecs."""

import onnxruntime
from mlserver import MLModel
from mlserver.codecs import NumpyCodec
from mlserver.types import InferenceRequest, InferenceResponse, ResponseOutput
from mlserver.utils import get_model_uri


class OnnxRuntime(MLModel):
    """The graph as it is: inputs by their names, outputs by theirs."""

    async def load(self) -> bool:
        """Open the file that the model's settings name."""
        path = await get_model_uri(self.settings)
        self.session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
        return True

    async def predict(self, payload: InferenceRequest) -> InferenceResponse:
        """All outputs for the inputs."""
        feed = {given.name: NumpyCodec.decode_input(given) for given in payload.inputs}
        names = [output.name for output in self.session.get_outputs()]
        made = zip(names, self.session.run(names, feed), strict=True)
        # Its codec would make a table of one column of what has one axis.
        outputs = [
            ResponseOutput(
                name=name,
                shape=list(tensor.shape),
                datatype="FP32",
                data=tensor.ravel().tolist(),
            )
            for name, tensor in made
        ]
        return InferenceResponse(model_name=self.name, id=payload.id, outputs=outputs)
