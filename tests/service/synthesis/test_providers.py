"""Tests of providers: the setting, its errors, and sizes of calls."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from graphics_card import FAULT

from posefield.common.errors import InvalidField, ModelError
from posefield.http import server
from posefield.http.api import settings
from posefield.inference import graph_ports, onnx_runtime, providers, session
from posefield.inference.graph_parts import GraphParts
from posefield.inference.providers import CPU, CUDA, PROVIDERS
from posefield.locomotion import stride
from posefield.registry import shipped_models
from posefield.registry.model_loading import ModelLoader

DOCS = Path(__file__).parents[3] / "docs"
FILES = sorted(shipped_models.FOLDER.glob("*.onnx"))


# --- the setting ----------------------------------------------------------------------------------


def test_the_environment_names_the_provider():
    assert providers.chosen_provider({}) is CPU
    assert providers.chosen_provider({"POSEFIELD_PROVIDER": "cpu"}) is CPU
    assert providers.chosen_provider({"POSEFIELD_PROVIDER": "cuda"}) is CUDA
    given = settings.read_settings(environ={"POSEFIELD_PROVIDER": "cuda"})
    assert (settings.Settings().provider, given.provider) == ("cpu", "cuda")


@pytest.mark.parametrize("name", ["", "gpu", "CUDA", "CUDAExecutionProvider"])
def test_an_unknown_provider_is_named_with_the_known_ones(name):
    expected = f"POSEFIELD_PROVIDER: {name!r}, expected cpu or cuda"
    with pytest.raises(InvalidField) as found:
        providers.chosen_provider({"POSEFIELD_PROVIDER": name})
    assert str(found.value) == expected
    with pytest.raises(InvalidField) as found:
        settings.read_settings(environ={"POSEFIELD_PROVIDER": name})
    assert str(found.value) == expected


# --- errors ---------------------------------------------------------------------------------------


@pytest.mark.skipif(FAULT is None, reason="a GPU computes here")
@pytest.mark.parametrize(
    "opened",
    [
        lambda: session.load(FILES[0]),
        lambda: ModelLoader([FILES[0]], most=1),
        lambda: server.open_models((str(FILES[0]),), settings.read_settings()),
    ],
    ids=["command", "loader", "service"],
)
def test_cuda_without_a_gpu_is_an_error_with_the_providers_found(opened, monkeypatch, capfd):
    monkeypatch.setenv("POSEFIELD_PROVIDER", "cuda")
    with pytest.raises(InvalidField, match="POSEFIELD_PROVIDER: 'cuda', but onnxruntime") as said:
        opened()
    assert "CPUExecutionProvider" in said.value.message and "expected" in said.value.message
    assert capfd.readouterr().out == ""


def test_performances_of_commands_are_computed_by_the_cpu(monkeypatch):
    """Negative control above: the same environment is an error for other commands."""
    monkeypatch.setenv("POSEFIELD_PROVIDER", "cuda")
    assert shipped_models.with_shipped([]).find("cmu_walk").session.provider is CPU


def test_a_session_that_would_compute_on_the_cpu_instead_is_an_error():
    unknown = replace(CUDA, execution="NoExecutionProvider", options=())
    with pytest.raises(ModelError, match="NoExecutionProvider"):
        onnx_runtime.open_session(FILES[0].read_bytes(), "walk.onnx", unknown)


def test_a_device_that_does_not_take_a_value_is_an_error_with_its_reason():
    """As where the package has CUDA, and the machine no driver."""
    absent = replace(CUDA, name="other", execution=CPU.execution, options=())
    if FAULT is None:
        absent = replace(absent, device="npu")
    with pytest.raises(InvalidField, match=r"no device computes: .+; expected a device") as said:
        onnx_runtime.require_provider(absent)
    assert said.value.message.startswith("'other', but onnxruntime 1")


def test_the_start_line_names_a_provider_other_than_the_cpu():
    url = "http://127.0.0.1:8000"
    assert server.start_line("walk", "cpu", url) == f"posefield: walk at {url}"
    assert (
        server.start_line("walk", "cuda", url) == f"posefield: walk, large calls on cuda, at {url}"
    )


# --- sizes of calls -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("provider", "crowd", "rows"),
    [
        ("cpu", 100, 512),
        ("cpu", 4000, 512),
        ("cpu", 10_000, 1250),
        ("cpu", 1_000_000, 1536),
        ("cuda", 100, 65_536),
        ("cuda", 1_000_000, 65_536),
    ],
)
def test_the_rows_of_a_call_are_those_of_the_table(provider, crowd, rows):
    assert PROVIDERS[provider].calls.rows_per_call(crowd) == rows


@pytest.mark.parametrize("provider", PROVIDERS.values(), ids=PROVIDERS)
def test_the_rows_of_walking_characters_are_split_without_single_ones(provider):
    most = provider.calls.walking
    for rows in (1, most, most + 1, 2 * most + 1, 2 * most + 2):
        sizes = [part.stop - part.start for part in stride.batches(rows, most)]
        last = rows - sum(sizes[:-1])
        assert max(sizes) <= most and 0 < last and (rows == 1 or last > 1)


def test_large_calls_alone_are_computed_by_the_provider():
    """A provider that cannot open a session answers small calls, which do not need it."""
    content, card = FILES[0].read_bytes(), session.load(FILES[0]).card
    absent = replace(CUDA, execution="NoExecutionProvider", options=())
    split = GraphParts(content, "walk.onnx", absent)
    feed = {"controls": graph_ports.default_controls(card).astype(np.float32)}
    feed["time"] = np.zeros((1, 1), np.float32)
    small = {name: values.repeat(CUDA.smallest - 1, axis=0) for name, values in feed.items()}
    assert len(split.run(["duration"], small, 0)[0]) == CUDA.smallest - 1
    large = {name: values.repeat(CUDA.smallest, axis=0) for name, values in feed.items()}
    with pytest.raises(ModelError, match="NoExecutionProvider"):
        split.run(["duration"], large, 0)


def test_the_documents_tell_the_sizes_and_the_tolerance():
    text = (DOCS / "operate/providers.md").read_text()
    assert f"{CUDA.smallest:,} rows" in text and f"{CUDA.calls.most:,}" in text
    assert f"within {providers.TOLERANCE:.0e}".replace("e-0", "e-") in text
