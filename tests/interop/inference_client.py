"""Client of a server of the Open Inference Protocol, with Triton's own library.

    inference_client.py HOST:PORT MODEL QUESTION.npz RESULT.npz [--json]

It sends one request, with one tensor per input; --json selects JSON instead of binary tensors.
"""

import sys
import time

import numpy as np
import tritonclient.http as protocol
from tritonclient.utils import InferenceServerException

PATIENCE = 120


def main(address, model, question, result, *options):
    """Write what the server answers; an AssertionError where it is no server of the protocol."""
    client = protocol.InferenceServerClient(address)
    _wait(client, model)
    assert client.is_server_live() and client.is_server_ready()
    assert client.get_model_metadata(model)["name"] == model
    binary = "--json" not in options
    with np.load(question) as given:
        inputs = [_input(name, given[name], binary) for name in given.files]
        wrong = [_input(name, given[name][:, :1], binary) for name in given.files]
    outputs = [protocol.InferRequestedOutput(name, binary) for name in _outputs(client, model)]
    answer = client.infer(model, inputs, outputs=outputs or None, request_id="7")
    said = answer.get_response()
    assert said["model_name"] == model and said["id"] == "7", said
    try:
        client.infer(model, wrong)
    except InferenceServerException as refused:
        assert refused.message(), "an error without words"
    else:
        raise AssertionError("it answers a question of the wrong shape")
    np.savez(result, **{o["name"]: answer.as_numpy(o["name"]) for o in said["outputs"]})


def _wait(client, model):
    end = time.monotonic() + PATIENCE
    while True:
        try:
            if client.is_model_ready(model):
                return
        except (OSError, InferenceServerException):
            pass
        if time.monotonic() > end:
            sys.exit(f"no model after {PATIENCE} s")
        time.sleep(0.2)


def _outputs(client, model):
    return [port["name"] for port in client.get_model_metadata(model).get("outputs", [])]


def _input(name, tensor, binary):
    made = protocol.InferInput(name, list(tensor.shape), "FP32")
    made.set_data_from_numpy(tensor, binary_data=binary)
    return made


if __name__ == "__main__":
    main(*sys.argv[1:])
