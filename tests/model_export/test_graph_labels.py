"""Tests of the graph's optional input of labels against the reference implementation."""

from dataclasses import replace

import numpy as np
import onnx
import onnxruntime
import pytest
from label_kernels import performers
from numpy.random import PCG64, Generator
from running import bank_values, outputs

from posefield.common.errors import ExportRefused
from posefield.inference import session
from posefield.kriging.kriging_model import Hyper
from posefield_train.graph import onnx_export
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.kriging_bank import ConstantModel, KrigingBank
from posefield_train.kriging.kriging_graph import COVARIANCES

SAMPLES, CONTROLS, BATCH = 25, 3, 40
LOW, HIGH = np.array([1.5, -60.0, 0.2]), np.array([1.9, 60.0, 1.8])
NAMES = ("ada", "bob", "cyd", "dee")


def rng():
    return Generator(PCG64(7))


def mixed(performers):
    """Return labels (B, p) of each performer and of none in turn."""
    return np.eye(performers + 1, performers)[np.arange(BATCH) % (performers + 1)]


def labelled_bank(covariance="matern52", drifts=(0, 1), names=NAMES, constant=(), correlation=0.4):
    """Fields pose, offsets and duration, in each of which performers have other offsets."""
    own = rng()
    points = own.uniform(-1.0, 1.0, (SAMPLES, CONTROLS))
    # Every sample is somebody's, and no performer has as many as another.
    whose = np.sqrt(np.arange(SAMPLES) / SAMPLES) * len(names)
    samples = np.hstack([points, np.eye(len(names))[whose.astype(int)]])
    fields, scales = {}, own.uniform(0.3, 1.5, CONTROLS)
    for name, size, offset in (("pose", 6, 0.6), ("offsets", 2, 9.0), ("duration", 1, 0.1)):
        nugget, trend = own.uniform(0.01, 0.3), own.uniform(0.1, 3.0)
        kernels = performers(len(names), correlation, offset)
        hyper = Hyper(covariance, drifts, scales, nugget, trend, kernels)
        values = own.normal(size=(SAMPLES, size))
        solved = universal_kriging.solve(hyper, samples, values)
        fields[name] = ConstantModel(values.mean(axis=0)) if name in constant else solved
    labels = {"performer": names}
    return KrigingBank(LOW, HIGH, labels, fields.pop("pose"), fields, 0.04)


def asked():
    """Controls all over, of which the first eight are those of samples, as the graph sees them."""
    points = rng().uniform(-1.2, 1.2, (BATCH, CONTROLS))
    points[:8] = labelled_bank().pose.samples[:8, :CONTROLS]
    controls = 0.5 * (points * (HIGH - LOW) + HIGH + LOW)
    return controls.astype(np.float32).astype(np.float64)


def graph_of(bank, rank=6):
    """Function of controls, and of labels where they are given, that runs the fields and sigma."""

    def build(net, controls, *_):
        return bank_values(net, bank, controls, [rank])

    return lambda controls, **labels: outputs(build, (2, 2, 2, 1), controls=controls, **labels)


def reference_of(bank, controls, labels):
    points = bank.points(controls, labels)
    variance, *values = bank.numpy(points).values()
    return [*values, bank.sigma(variance)]


def apart(found, expected):
    return max(np.abs(a - b).max() for a, b in zip(found, expected, strict=True))


CASES = {
    **{
        f"{name}, drifts {drifts}": {"covariance": name, "drifts": drifts}
        for name in COVARIANCES
        for drifts in (((0,), (1,), (0, 1)) if name == "matern52" else ((1,),))
    },
    "one performer": {"names": ("ada",)},
    "a constant field": {"constant": ("offsets",)},
    "motions of performers alike beside offsets": {"correlation": 1.0},
    "unrelated motions of performers": {"correlation": 0.0},
}


@pytest.mark.parametrize("given", CASES.values(), ids=CASES)
def test_the_graph_tells_performers_apart_as_the_reference_does(given):
    bank, controls = labelled_bank(**given), asked()
    labels = mixed(bank.label_count)
    found = graph_of(bank)(controls, labels=labels)
    # At a sample the distance is a root of what rounding leaves, where these have their kink.
    allowed = 5e-3 if given.get("covariance") in ("exponential", "spherical") else 2e-4
    assert apart(found, reference_of(bank, controls, labels)) < allowed
    # Negative controls: everybody taken for the next, and nobody told apart.
    others = np.roll(labels, 1, axis=0)
    assert apart(found, reference_of(bank, controls, others)) > 4 * allowed
    assert apart(found, reference_of(bank, controls, 0 * labels)) > 4 * allowed


# --- a whole model --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def opened(labelled_path):
    return session.load(labelled_path)


def test_the_gate_asks_for_performers(labelled_exported, labelled_path, opened):
    content = labelled_path.read_bytes()
    assert (
        0.0
        < onnx_export.check_parity(labelled_exported.model, content, opened.card)
        < onnx_export.PARITY_LIMIT
    )
    bank = labelled_exported.model.bank
    # Two performers change places: nobody would notice who asks for controls alone.
    samples = bank.pose.samples.copy()
    samples[:, [4, 5]] = samples[:, [5, 4]]
    swapped = replace(bank, pose=replace(bank.pose, samples=samples))
    points = np.array([[control.default for control in opened.card.controls]])
    times = np.linspace(0.0, 1.0, 5)[None]
    model = replace(labelled_exported.model, bank=swapped)
    before, after = (m.evaluate(points, times).rotations for m in (labelled_exported.model, model))
    assert np.array_equal(before, after)
    with pytest.raises(ExportRefused, match=r"at (middle|short), \{'stature': "):
        onnx_export.check_parity(model, content, opened.card)


def quiet():
    options = onnxruntime.SessionOptions()
    # One level above the remark that an input with a default cannot be folded.
    options.log_severity_level = 3
    return options


def test_the_port_is_optional_and_only_there_where_it_is_needed(labelled_path, model_path):
    def ports(path):
        runtime = onnxruntime.InferenceSession(path, quiet(), providers=["CPUExecutionProvider"])
        optional = runtime.get_overridable_initializers()
        return [p.name for p in runtime.get_inputs()], [(p.name, p.shape) for p in optional]

    both = ["controls", "time"]
    level = ("level", [])
    assert ports(labelled_path) == (both, [("labels", ["batch_or_one", 3]), level])
    assert ports(model_path) == (both, [level])
    plain = onnx.load(model_path).graph
    assert "OneHot" not in {node.op_type for node in plain.node}


def test_controls_and_time_alone_are_enough_for_a_plain_onnxruntime(labelled_path, capfd):
    runtime = onnxruntime.InferenceSession(
        labelled_path, quiet(), providers=["CPUExecutionProvider"]
    )
    middle = [control.default for control in session.load(labelled_path).card.controls]
    for batch in (1, 5, 300):
        feed = {
            "controls": np.tile(np.array(middle, "f4"), (batch, 1)),
            "time": np.zeros((batch, 4), "f4"),
        }
        given = {**feed, "labels": np.zeros((batch, 3), "f4")}
        assert apart(runtime.run(None, feed), runtime.run(None, given)) == 0.0
    assert capfd.readouterr().err == ""
